"""A running system answers: its name, its state, and the services by which it is asked."""
