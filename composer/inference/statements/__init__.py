"""Follow the statements of behaviours: what they store, and on which conditions."""
