"""Parse the source of a module, within limits on time and memory."""

from __future__ import annotations

import ast
import re
from itertools import islice
from typing import TYPE_CHECKING, TypeAlias

from composer.errors import ComposerError
from composer.input_limits import MAX_MODULE_TOKENS

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef

_TOKEN = re.compile(rb'\w+|[^\w ]')
# The compiler compares those of one scope with each other: ten thousand equal ones take seconds.
_CODE_OBJECT = re.compile(rb'\b(?:def|lambda)\b|\bfor\b[^\n]*?\bin\b')
_MOST_CODE_OBJECTS = 4000
# It copies each `finally` for each way out of its `try`: nested ones make gigabytes of a line.
_MOST_COPIED_CHARACTERS = 200_000
_CHARACTERS_OF_LINE = 40
_WAYS_OUT = (ast.Return, ast.Break, ast.Continue)
# The fields of statements that hold others.
BLOCKS = ('body', 'handlers', 'cases', 'orelse', 'finalbody')


class UnreadModuleError(ComposerError):
    """A module may be valid, and is not read: it is too large, or nests too deep."""


def list_children(node: ast.AST) -> list[ast.AST]:
    """Return the nodes right below a node, without the contexts of names, three times as fast."""
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if value.__class__ is list:
            found += [each for each in value if isinstance(each, ast.AST)]
        elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
            found.append(value)
    return found


def list_nodes(body: Iterable[ast.AST]) -> list[ast.AST]:
    """Return nodes and all below them, without the contexts of names."""
    nodes = [*body]
    for node in nodes:
        nodes += list_children(node)
    return nodes


def count_tokens(content: bytes, path: Path, most: int) -> int:
    """Return how many words and signs a source has, which is what its syntax tree grows with.

    Raises:
        UnreadModuleError: They are more than a module may have, or than `most`.
    """
    enough = min(MAX_MODULE_TOKENS, most) + 1
    count = sum(1 for _ in islice(_TOKEN.finditer(content), enough))
    if count > MAX_MODULE_TOKENS:
        message = f'{path} has more than {MAX_MODULE_TOKENS:,} words and signs'
        raise UnreadModuleError(message)
    if count > most:
        message = f'{path} and the modules before it are too many to be read'
        raise UnreadModuleError(message)
    return count


def parse_source(content: bytes, path: Path) -> ast.Module:
    """Return the syntax tree of a module.

    Raises:
        SyntaxError: It is not valid Python.
        ValueError: As `SyntaxError`, of what Python does not even tokenize.
        RecursionError: As `SyntaxError`: Python itself cannot read what nests so deep.
        MemoryError: Likewise.
        UnreadModuleError: It is valid, and nests too deep.
    """
    try:
        tree = ast.parse(content, str(path))
    except (RecursionError, MemoryError) as error:
        # Python may read what is too deep for a syntax tree.
        compile(content, str(path), 'exec', dont_inherit=True)
        message = f'{path} nests too deep'
        raise UnreadModuleError(message) from error
    if len(_CODE_OBJECT.findall(content)) <= _MOST_CODE_OBJECTS and _is_cheap(tree):
        # The compiler finds more errors than the parser, such as `return` outside a function.
        compile(content, str(path), 'exec', dont_inherit=True)
    return tree


def _is_cheap(tree: ast.Module) -> bool:
    """Return whether a compiled module is not much larger than its source."""
    written, compiled, _ = _measure(tree.body)
    return compiled - written <= _MOST_COPIED_CHARACTERS


def _measure(body: Iterable[ast.AST]) -> tuple[int, int, int]:
    """Return the size of a block as written and as compiled, and the ways out of it."""
    written = compiled = ways_out = 0
    pending: list[ast.AST] = list(body)
    while pending:
        node = pending.pop()
        ways_out += isinstance(node, _WAYS_OUT)
        blocks = [getattr(node, name, None) or [] for name in BLOCKS]
        if not any(blocks):
            size = _size_of(node)
            written, compiled = written + size, compiled + size
        elif final := getattr(node, 'finalbody', None):
            inner = _measure(each for block in blocks[:-1] for each in block)
            last = _measure(final)
            copies = 2 + inner[2]
            written += inner[0] + last[0]
            compiled += inner[1] + last[1] * copies
            ways_out += inner[2] + last[2] * copies
        else:
            pending += (each for block in blocks for each in block if isinstance(each, ast.AST))
    return written, compiled, ways_out


def _size_of(node: ast.AST) -> int:
    """Return the length of a statement in characters, about."""
    lines = (getattr(node, 'end_lineno', 0) or 0) - getattr(node, 'lineno', 0)
    columns = (getattr(node, 'end_col_offset', 0) or 0) - getattr(node, 'col_offset', 0)
    return lines * _CHARACTERS_OF_LINE if lines else columns
