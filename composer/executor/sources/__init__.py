"""Event sources: a source listens to one entity, takes what came and runs its callback."""
