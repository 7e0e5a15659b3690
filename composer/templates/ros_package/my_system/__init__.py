"""What the nodes of my_system do."""
