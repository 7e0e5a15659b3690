"""`composer up`, and how a running system follows its files."""
