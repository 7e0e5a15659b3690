"""The fixtures of the tests that build interface packages."""

from building import run_python, shared_cache, write_definitions

__all__ = ['run_python', 'shared_cache', 'write_definitions']
