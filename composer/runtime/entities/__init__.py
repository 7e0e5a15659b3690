"""One file for each kind of entity."""
