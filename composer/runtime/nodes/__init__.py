"""Nodes without their entities: what these share, and what behaviours see."""
