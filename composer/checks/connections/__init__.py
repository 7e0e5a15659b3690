"""Checks of what connects nodes: topics, services, actions and waits."""
