"""What Python and its library make of values."""
