"""Infer what behaviours do with their nodes and messages, without running them."""
