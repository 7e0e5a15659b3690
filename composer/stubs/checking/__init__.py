"""Check behaviours by types: annotated copies of them, and pyrefly's reports as findings."""
