"""The page of a system: what runs, where it hurts, and why.

It is a process of its own. It asks a running system by the same services as `composer top`, and
reads its files; nothing in a behaviour's way waits for it.
"""
