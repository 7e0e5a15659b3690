"""Included files: read, and merged into the file that includes them."""
