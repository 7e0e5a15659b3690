"""The commands that bring systems to hosts and ask them there."""
