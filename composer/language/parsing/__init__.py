"""Plain data that satisfy the schema → specs."""
