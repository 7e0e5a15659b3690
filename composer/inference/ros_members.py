"""What `node.ros` has, as the source of the installed rclpy says."""

from __future__ import annotations

import ast
import importlib.util
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from composer.python_source.modules import read_signature

if TYPE_CHECKING:
    import inspect
    from collections.abc import Mapping

_CLASSES = {'Node', 'LifecycleNodeMixin', 'LifecycleNode'}


@cache
def ros_members() -> Mapping[str, inspect.Signature | None]:
    """Return the public methods of `node.ros`, without rclpy nothing; of a property, `None`."""
    package = importlib.util.find_spec('rclpy')
    members: dict[str, inspect.Signature | None] = {}
    for folder in package.submodule_search_locations or () if package else ():
        for path in (Path(folder) / 'node.py', Path(folder) / 'lifecycle' / 'node.py'):
            try:
                tree = ast.parse(path.read_bytes())
            except (OSError, SyntaxError):
                return {}
            for of in tree.body:
                if isinstance(of, ast.ClassDef) and of.name in _CLASSES:
                    members |= dict(map(_member, _methods(of)))
    return members


def _methods(of: ast.ClassDef) -> list[ast.FunctionDef]:
    return [each for each in of.body if isinstance(each, ast.FunctionDef) and each.name[0] != '_']


def _member(method: ast.FunctionDef) -> tuple[str, inspect.Signature | None]:
    if method.decorator_list:
        return method.name, None
    signature = read_signature(method.args)
    rest = [each.replace(annotation=each.empty) for each in signature.parameters.values()][1:]
    return method.name, signature.replace(parameters=rest)
