"""What the commands share: their arguments, the files these name, and output."""
