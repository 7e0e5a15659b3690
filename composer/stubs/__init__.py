"""Typed stubs of a system's messages and nodes, and type checkers that use them."""
