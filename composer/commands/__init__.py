"""The commands of the tool, a file each."""
