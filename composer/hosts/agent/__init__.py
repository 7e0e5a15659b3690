"""What `composer deploy` runs on a host: sent there each time, with Python's own library only."""
