"""The commands that tell what is wrong, or what would change: `check`, `plan`, `explain`."""
