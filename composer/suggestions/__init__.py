"""Which nodes of a system should run in processes of their own, from what was measured."""
