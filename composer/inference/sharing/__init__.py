"""What behaviours share in code, as long as they run in one process."""
