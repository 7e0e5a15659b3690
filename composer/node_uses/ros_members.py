"""What `node.ros` has, as the source of the installed rclpy says."""

from __future__ import annotations

import ast
import importlib.util
from functools import cache
from pathlib import Path

_CLASSES = {'Node', 'LifecycleNodeMixin', 'LifecycleNode'}


@cache
def ros_members() -> frozenset[str]:
    """Return the names of the public methods and properties of `node.ros`; without rclpy, none."""
    package = importlib.util.find_spec('rclpy')
    names: set[str] = set()
    for folder in package.submodule_search_locations or () if package else ():
        for path in (Path(folder) / 'node.py', Path(folder) / 'lifecycle' / 'node.py'):
            try:
                tree = ast.parse(path.read_bytes())
            except (OSError, SyntaxError):
                return frozenset()
            for of in tree.body:
                if isinstance(of, ast.ClassDef) and of.name in _CLASSES:
                    methods = (each for each in of.body if isinstance(each, ast.FunctionDef))
                    names |= {each.name for each in methods if each.name[0] != '_'}
    return frozenset(names)
