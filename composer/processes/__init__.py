"""External processes: their supervisor, and the reaper that ends them with the system."""
