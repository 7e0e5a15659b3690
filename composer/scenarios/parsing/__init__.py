"""Data of a scenario file, valid by its schema → specs."""
