"""Which arguments foreign code only writes into its result, and which of them decide what it does.

The code is run with the arguments as they are, and again with a mark in place of each that it has
read. If the result is the same but for the mark, an expression can take its place; unless the code
has compared it with something, or looked for it, which may end otherwise with another value. What
Python does in C shows no mark (`f'{robot}_x' == 'a_x'`): launch files are compiled with a call
around each part that makes, compares or searches texts.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
import os
from importlib.machinery import SourceFileLoader
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from composer.launch_files.texts import Text, constant, has_marks, marked, one

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from typing import Self

_Result = TypeVar('_Result')
# Each is a run of the code.
_MOST_TRIED = 40
# Methods that the language has, too, for texts.
_SAME = ('lower', 'upper', 'strip', 'lstrip', 'rstrip', 'replace', 'removeprefix', 'removesuffix')
_LOOKS = (
    *('__eq__', '__ne__', '__lt__', '__le__', '__gt__', '__ge__', '__hash__', '__contains__'),
    *('__len__', '__iter__', '__getitem__', *(name for name in dir(str) if name[0] != '_')),
)
# The name that launch loads its files with.
_MODULE = 'python_launch_file'
_PATH_PARTS = ('name', 'stem', 'suffix', 'suffixes', 'parts', 'parent', 'parents', 'anchor')
_SEARCHES = (
    *('match', 'search', 'fullmatch', 'findall', 'finditer', 'split', 'sub', 'subn', 'fnmatch'),
    *('fnmatchcase', 'startswith', 'endswith', 'count', 'index', 'find', 'get', 'is_absolute'),
)
_looked: list[object] = []


class Mark(str):
    """A text that stands for another one in what code makes of it, and notes if it is read.

    Attributes:
        stands_for: The other one. What reads the mark gets its value.
    """

    __slots__ = ('stands_for',)
    stands_for: Text

    def __new__(cls, text: Text) -> Self:
        """Return the mark for a text."""
        self = super().__new__(cls, marked(text))
        self.stands_for = text
        return self

    @classmethod
    def of(cls, text: str) -> Self:
        """Return a text that has marks as one mark."""
        self = super().__new__(cls, text)
        self.stands_for = constant(text)
        return self

    def __int__(self) -> int:
        """Return the value as a number, as `int` does."""
        note_look(self)
        return int(self.stands_for.text)

    def __float__(self) -> float:
        """Return the value as a number, as `float` does."""
        note_look(self)
        return float(self.stands_for.text)


def note_look(what: object) -> None:
    """Note that what is read now may decide what the code does."""
    _looked.append(what)


def _noting(name: str) -> Any:
    method = getattr(str, name)

    def look(mark: Mark, *args: Any, **keywords: Any) -> Any:
        value = method(mark.stands_for.text, *args, **keywords)
        if name in _SAME and not keywords and all(type(each) in (str, int) for each in args):
            shown = ', '.join(map(repr, args))
            return Mark(one(f'{mark.stands_for.code}.{name}({shown})', value))
        note_look(mark)
        return value

    return look


for _name in _LOOKS:
    setattr(Mark, _name, _noting(_name))


def run_marked(
    configurations: Mapping[str, Any],
    attempt: Callable[[frozenset[str]], tuple[_Result, Iterable[str]]],
    outcome: Callable[[_Result], Any],
) -> tuple[_Result, list[str]]:
    """Return the result with as many marks as possible, and the names that decide.

    Args:
        attempt: Runs the code with marks for some names; returns what it has read, too.
        outcome: Returns the result with the values of marks in place.
    """
    plain, read = attempt(frozenset())
    expected = outcome(plain)

    def succeeds(names: frozenset[str]) -> _Result | None:
        before = len(_looked)
        try:
            with _quiet():
                result, _ = attempt(names)
                is_same = len(_looked) == before and outcome(result) == expected
                return result if is_same else None
        except Exception:  # noqa: BLE001 - foreign code, given what it never expected
            return None
        finally:
            del _looked[before:]

    names = [
        name
        for name in read
        if isinstance(value := configurations.get(name), Text) and not value.is_constant
    ]
    safe = frozenset(each for each in names[:_MOST_TRIED] if succeeds(frozenset((each,))))
    best = succeeds(safe) if safe else None
    if best is None:
        return plain, names
    return best, [name for name in names if name not in safe]


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hide what the code prints in its further runs."""
    with (
        open(os.devnull, 'w', encoding='utf-8') as null,  # noqa: PTH123 - not a path
        contextlib.redirect_stdout(null),
        contextlib.redirect_stderr(null),
    ):
        yield


def keep_mark(value: Any) -> Any:
    """Return a text made of marks as a mark, and anything else as it is."""
    return Mark.of(value) if type(value) is str and has_marks(value) else value


def look_at(value: Any) -> Any:
    """Note that something is compared or searched, if it has marks; return it."""
    if isinstance(value, str | PurePath) and has_marks(str(value)):
        note_look(value)
    return value


@contextlib.contextmanager
def following_texts() -> Iterator[None]:
    """Compile launch files so that texts made of marks are marks, too."""
    before = SourceFileLoader.get_code

    def get_code(loader: SourceFileLoader, name: str) -> Any:
        if name != _MODULE:
            return before(loader, name)
        # Not the cached one, and nothing to be cached.
        tree = ast.parse(loader.get_data(loader.path), loader.path)
        tree = ast.fix_missing_locations(_Followed().visit(tree))
        return compile(tree, loader.path, 'exec', dont_inherit=True)

    vars(builtins).update(_composer_keep=keep_mark, _composer_look=look_at)
    setattr(SourceFileLoader, 'get_code', get_code)  # noqa: B010 - mypy refuses a method
    try:
        yield
    finally:
        setattr(SourceFileLoader, 'get_code', before)  # noqa: B010


def _call(function: str, node: ast.expr) -> ast.expr:
    name = ast.Name(f'_composer_{function}', ast.Load())
    return ast.copy_location(ast.Call(name, [node], []), node)


class _Followed(ast.NodeTransformer):
    """The code of a launch file, with the calls in it."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.expr:
        for value in node.values:
            if isinstance(value, ast.FormattedValue):
                # Not its format, which is a JoinedStr but no expression.
                value.value = self.visit(value.value)
                is_plain = value.format_spec is None and value.conversion in (-1, ord('s'))
                value.value = value.value if is_plain else _call('look', value.value)
        return _call('keep', node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        return _call('keep', node)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        node.left = _call('look', node.left)
        node.comparators = [_call('look', each) for each in node.comparators]
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in ('super', 'locals'):
            return node
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ''
        if name in _SEARCHES:
            node.args = [
                each if isinstance(each, ast.Starred) else _call('look', each)
                for each in node.args
            ]
            for keyword in node.keywords:
                keyword.value = _call('look', keyword.value)
        return _call('keep', node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        if node.attr in _PATH_PARTS and isinstance(node.ctx, ast.Load):
            node.value = _call('look', node.value)
        return node
