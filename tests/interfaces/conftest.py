"""The fixtures of the tests that build interface packages."""

from building import run_python, write_definitions

__all__ = ['run_python', 'write_definitions']
