"""Interface packages that are not installed, built and cached."""
