"""Nodes in processes of their own: started, stopped, watched and edited with their system."""
