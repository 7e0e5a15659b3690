"""`composer import`: launch files to systems."""
