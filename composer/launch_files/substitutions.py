"""Substitutions of launch files → texts, with expressions where they depend on arguments.

Objects of `launch` are recognised by the names of their classes: nothing of it is imported.
"""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from composer.ament import find_share
from composer.launch_files.results import Argument, LaunchError
from composer.launch_files.texts import (
    EMPTY,
    Code,
    Kind,
    Text,
    chosen,
    constant,
    joined,
    one,
    read_yaml,
    split_words,
)
from composer.ros_parameters.rcl_values import read_plain_scalar

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    from composer.launch_files.place import Place

_SHARE = re.compile(r'^(?:file://)?(/[^\s:]*?)/share/([A-Za-z]\w*)(?=/|$)')
_FOUND = re.compile(r"find\('\w+'\)")
# What `LaunchConfigAsBool` takes for true.
_TRUE = ('true', '1', 'yes', 'on')
# What launch itself reads, for each program: arguments only where a launch file declares them.
_OF_LAUNCH = (
    *('launch-prefix', 'launch-prefix-filter', 'sigterm_timeout', 'sigkill_timeout'),
    *('emulate_tty', 'output', 'log_file_name', 'ros_namespace'),
)
# Where the files of packages would be that are not installed.
_ABSENT = '/share/of/package'
_NAME = re.compile(r'(__part_\d+__)')
# What both languages write alike, and take for the same.
_ALIKE = (
    *(ast.Compare, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.IfExp, ast.List, ast.Load),
    *(ast.And, ast.Or, ast.Not, ast.USub, ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
    *(ast.In, ast.NotIn, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod, ast.Pow),
)
_METHODS = ('lower', 'upper', 'strip', 'startswith', 'endswith')


def private(owner: Any, name: str) -> Any:
    """Return a private attribute of an object of `launch`, whichever class it is of."""
    for kind in type(owner).__mro__:
        mangled = f'_{kind.__name__.lstrip("_")}__{name}'
        if hasattr(owner, mangled):
            return getattr(owner, mangled)
    return getattr(owner, name, getattr(owner, f'_{name}', None))


def class_names(value: Any) -> list[str]:
    """Return the names of the classes of an object, its own first."""
    return [kind.__name__ for kind in type(value).__mro__]


class Resolver:
    """Resolves substitutions at one place of a launch file.

    Args:
        place: Where it is, and who is told what cannot be kept.
    """

    def __init__(self, place: Place) -> None:
        self._place = place
        self._scope = place.scope
        self._context = place.loader.context
        self._remark = place.remark

    def text(self, written: Any) -> Text:
        """Return the text of a substitution, of a text, or of a sequence of both."""
        if written is None:
            return EMPTY
        if isinstance(written, str | Path):
            return text_of(str(written))
        if isinstance(written, bool | int | float):
            return text_of(str(written))
        if isinstance(written, list | tuple):
            return joined(map(self.text, written))
        return self._substitution(written)

    def is_true(self, written: Any) -> Text:
        """Return a text for something that is true or false."""
        if isinstance(written, bool):
            return text_of('true' if written else 'false')
        return self.text(written)

    def _substitution(self, written: Any) -> Text:
        for name in class_names(written):
            if name in _KINDS:
                found: Text = getattr(self, _KINDS[name])(written)
                return found
        return self._performed(written)

    def _performed(self, written: Any) -> Text:
        """Return what a class of the launch file's own makes of the arguments as they are."""
        context = self._context
        result = self._place.resolve(
            type(written).__name__, lambda: context.perform_substitution(written)
        )
        return text_of(str(result))

    def _text(self, written: Any) -> Text:
        return text_of(str(written.text))

    def _configuration(self, written: Any) -> Text:
        name = self.text(private(written, 'variable_name')).text
        value = self._scope.configurations.get(name)
        if isinstance(value, Text):
            return value
        default = private(written, 'default')
        if name in _OF_LAUNCH and default is not None:
            return self.text(default)
        if default is None and name not in self._place.given:
            origin = self._place.origin
            message = f"{origin}: the launch configuration '{name}' is used, but nothing sets it"
            raise LaunchError(message, help=f'give it a value: {name}:=…')
        otherwise = None if default is None else self.text(default)
        known = self._place.result.arguments.get(name)
        if known is not None and otherwise is not None and known.default != otherwise:
            self._remark(f"the argument '{name}' is {otherwise.text!r} here unless it is given")
            if name not in self._place.given:
                return otherwise
        # Nothing declares it, but whoever launches the file can set it.
        return self._place.declare(known or Argument(name, otherwise))

    def _variable(self, written: Any) -> Text:
        name = self.text(private(written, 'name')).text
        default = private(written, 'default_value')
        if (own := self._scope.environment.get(name)) is not None:
            return own
        if default is None:
            return one(f"env('{name}')", os.environ.get(name, ''))
        otherwise = self.text(default)
        text = os.environ.get(name, otherwise.text)
        return one(f"env('{name}', {otherwise.code})", text)

    def _share(self, written: Any) -> Text:
        name = self.text(private(written, 'package'))
        share = find_share(name.text)
        return one(f'find({name.code})', str(share or f'{_ABSENT}/{name.text}'))

    def _prefix(self, written: Any) -> Text:
        name = self.text(private(written, 'package')).text
        share = find_share(name)
        text = str(share.parent.parent) if share else f'{_ABSENT}/{name}'
        return one(f"(find('{name}').removesuffix('/share/{name}'))", text)

    def _executable_in_package(self, written: Any) -> Text:
        program = self.text(private(written, 'executable'))
        package = self.text(private(written, 'package'))
        return joined((self._prefix(written), Text(('/lib',)), package, program), '/')

    def _path(self, written: Any) -> Text:
        return path_of([self.text(each) for each in private(written, 'substitutions')])

    def _file(self, _written: Any) -> Text:
        return text_of(str(self._scope.file))

    def _file_folder(self, _written: Any) -> Text:
        return text_of(str(self._scope.file.parent if self._scope.file else ''))

    def _program(self, written: Any) -> Text:
        return self.text(private(written, 'name'))

    def _python(self, written: Any) -> Text:
        source = self.text(private(written, 'expression'))
        modules = [self.text(each).text for each in private(written, 'python_modules') or ()]
        result = str(self._evaluated(source.text, modules))
        try:
            return translate(source, result)
        except UnlikeError:
            self._place.freeze(source.text, source)
            return text_of(result)

    def _evaluated(self, source: str, modules: Sequence[str]) -> Any:
        import importlib

        names: dict[str, Any] = {}
        for module in modules:
            loaded = importlib.import_module(module)
            names |= vars(loaded) if module == 'math' else {}
            names[module] = loaded
        try:
            # It is the user's launch file, which is Python and has run already.
            return eval(source, {}, names)  # noqa: S307
        except Exception as error:
            message = f'the expression {source} cannot be evaluated: {error}'
            raise LaunchError(message) from error

    def _as_bool(self, written: Any) -> Text:
        """Return what nav2's `LaunchConfigAsBool` makes of a configuration."""
        value = self.text(private(written, 'config'))
        text = str(value.text.strip().lower() in _TRUE)
        if value.is_constant:
            return text_of(text)
        return one(f'({value.code} | lower in {list(_TRUE)})', text, 'python-bool')

    def _not(self, written: Any) -> Text:
        value = self.text(private(written, 'value'))
        return self._truth(f'(not {_bracketed(value)})', not _truth(value), value)

    def _both(self, written: Any) -> Text:
        return self._combined((private(written, 'left'), private(written, 'right')), 'and')

    def _either(self, written: Any) -> Text:
        return self._combined((private(written, 'left'), private(written, 'right')), 'or')

    def _all(self, written: Any) -> Text:
        return self._combined(private(written, 'args'), 'and')

    def _any(self, written: Any) -> Text:
        return self._combined(private(written, 'args'), 'or')

    def _combined(self, written: Sequence[Any], word: str) -> Text:
        values = [self.text(each) for each in written]
        test = all if word == 'and' else any
        code = f'({f" {word} ".join(map(_bracketed, values))})'
        return self._truth(code, test(map(_truth, values)), *values)

    def _equal(self, written: Any) -> Text:
        left, right = self.text(private(written, 'left')), self.text(private(written, 'right'))
        is_boolean = any(
            each.is_constant and each.text.lower() in ('true', 'false') for each in (left, right)
        )
        codes = [f'{each.code} | lower' if is_boolean else each.code for each in (left, right)]
        lefts = [each.text.lower() if is_boolean else each.text for each in (left, right)]
        return self._truth(f'({codes[0]} == {codes[1]})', lefts[0] == lefts[1], left, right)

    def _unequal(self, written: Any) -> Text:
        equal = self._equal(written)
        if equal.is_constant:
            return text_of('false' if equal.text == 'true' else 'true')
        return one(f'(not {equal.code})', 'false' if equal.text == 'true' else 'true', 'bool')

    def _truth(self, code: str, value: bool, *of: Text) -> Text:  # noqa: FBT001 - the value itself
        text = 'true' if value else 'false'
        if all(each.is_constant for each in of):
            return text_of(text)
        return one(code, text, 'bool')

    def _one_of_two(self, written: Any) -> Text:
        condition = self.text(private(written, 'condition'))
        then = self.text(private(written, 'if_value'))
        otherwise = self.text(private(written, 'else_value'))
        if condition.is_constant:
            return then if _truth(condition) else otherwise
        return chosen(f'({condition.condition()})', then, otherwise, is_true=_truth(condition))

    def command_words(self, written: Any) -> list[Text] | None:
        """Return the words of a `Command`; `None` if that is not what is written."""
        items = written if isinstance(written, list | tuple) else [written]
        if len(items) != 1 or 'Command' not in class_names(items[0]):
            return None
        return split_words(self.text(private(items[0], 'command')))


def path_of(parts: Sequence[Text]) -> Text:
    """Return parts of a path as one, as `os.path.join` does: an absolute part comes alone."""
    texts = [part.text for part in parts]
    ends = [part.parts[-1:] for part in parts[:-1]] + [part.parts[:1] for part in parts[1:]]
    if any(isinstance(each, Code) and not _is_share(each) for end in ends for each in end):
        codes = ', '.join(part.code for part in parts)
        return one(f'([{codes}] | path_join)', os.path.join(*texts))  # noqa: PTH118 - of texts
    path = EMPTY
    for part in parts:
        if part.text.startswith('/') or not path.parts:
            path = part
        else:
            path = joined((path, part), '' if path.text.endswith('/') else '/')
    return path


def _is_share(part: Code) -> bool:
    return _FOUND.fullmatch(part.code) is not None


def text_of(text: str) -> Text:
    """Return a text, with the share folders of packages in it as `find(…)`."""
    found = _SHARE.match(text)
    if found is None:
        return constant(text)
    folder, package = f'{found[1]}/share/{found[2]}', found[2]
    if str(find_share(package)) != folder and not folder.startswith(f'{_ABSENT}/'):
        return constant(text)
    scheme = 'file://' if text.startswith('file://') else ''
    parts = (scheme, Code(f"find('{package}')", folder), text[found.end() :])
    return Text(tuple(part for part in parts if part))


class _RosLoader(yaml.BaseLoader):
    """Reads keys and values as ROS does: `no` is a text as a key, and `1e-6` a number."""

    def construct_scalar(self, node: Any) -> Any:
        """Return the value of a scalar."""
        return node.value if node.style in ('"', "'") else read_plain_scalar(node.value)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:  # noqa: FBT001, FBT002, ARG002 - of PyYAML
        """Return a mapping, with its keys as they are written."""
        return {
            str(key.value): self.construct_object(value, deep=True) for key, value in node.value
        }


def read_file(path: str, *, is_dumped: bool = False) -> Any:
    """Return the data of a YAML file as ROS reads them; `None` if it has none.

    Args:
        is_dumped: Whether launch reads the file and writes it anew, with PyYAML.
    """
    try:
        text = Path(path).read_text(encoding='utf-8')
        text = yaml.safe_dump(yaml.safe_load(text)) if is_dumped else text
        return yaml.load(text, _RosLoader)  # noqa: S506 - makes plain data
    except (OSError, ValueError, yaml.YAMLError):
        return None


def _truth(value: Text) -> bool:
    text = value.text.strip().lower()
    if text not in ('true', '1', 'false', '0'):
        read = read_yaml(value.text)
        if isinstance(read, bool):
            return read
        message = f"'{value.text}' is neither true nor false"
        raise LaunchError(message)
    return text in ('true', '1')


def _bracketed(value: Text) -> str:
    return f'({value.condition()})'


truth_of = _truth


# The method for each class of substitutions.
_KINDS = {
    'TextSubstitution': '_text',
    'LaunchConfiguration': '_configuration',
    'EnvironmentVariable': '_variable',
    'FindPackageShare': '_share',
    'FindPackagePrefix': '_prefix',
    'ExecutableInPackage': '_executable_in_package',
    'PathJoinSubstitution': '_path',
    'ThisLaunchFile': '_file',
    'ThisLaunchFileDir': '_file_folder',
    'FindExecutable': '_program',
    'PythonExpression': '_python',
    'LaunchConfigAsBool': '_as_bool',
    'NotSubstitution': '_not',
    'AndSubstitution': '_both',
    'OrSubstitution': '_either',
    'AllSubstitution': '_all',
    'AnySubstitution': '_any',
    'EqualsSubstitution': '_equal',
    'NotEqualsSubstitution': '_unequal',
    'IfElseSubstitution': '_one_of_two',
}


class UnlikeError(Exception):
    """There is no such expression in the language."""


def translate(source: Text, result: str) -> Text:
    """Return the value of Python source as an expression; a constant if there is none.

    Args:
        result: Its value as a text, with the arguments as they are given to the import.

    Raises:
        UnlikeError: It depends on arguments, and means nothing in the language.
    """
    names = [
        part if isinstance(part, str) else f'__part_{i}__' for i, part in enumerate(source.parts)
    ]
    parts = {
        name: part
        for name, part in zip(names, source.parts, strict=True)
        if isinstance(part, Code)
    }
    if not parts:
        return constant(result)
    try:
        tree = ast.parse(''.join(names).strip(), mode='eval')
    except SyntaxError as error:
        raise UnlikeError from error
    code = ast.unparse(_Translator(parts).visit(tree.body))
    return one(f'({code})', result, _kind_of(result))


def _kind_of(result: str) -> Kind:
    if result in ('True', 'False'):
        return 'python-bool'
    return 'number' if re.fullmatch(r'-?\d+(\.\d+)?', result) else 'text'


class _Translator(ast.NodeTransformer):
    """Puts the expressions of arguments in the place of their names."""

    def __init__(self, parts: Mapping[str, Code]) -> None:
        self._parts = parts

    def visit_Name(self, node: ast.Name) -> ast.expr:
        part = self._parts.get(node.id)
        if part is None:
            raise UnlikeError
        # Bare, it is Python itself: a number or `True`.
        return ast.Name(part.code if part.kind != 'text' else f'({part.code} | from_yaml)')

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if not isinstance(node.value, str):
            return node
        pieces = (self._parts.get(piece, piece) for piece in _NAME.split(node.value) if piece)
        return ast.Name(Text(tuple(pieces)).code)

    def visit_Tuple(self, node: ast.Tuple) -> ast.expr:
        return ast.List([self.visit(item) for item in node.elts], ast.Load())

    def visit_Call(self, node: ast.Call) -> ast.expr:
        function = node.func
        if (
            not isinstance(function, ast.Attribute)
            or function.attr not in _METHODS
            or node.keywords
        ):
            raise UnlikeError
        function.value = self.visit(function.value)
        node.args = [self.visit(argument) for argument in node.args]
        return node

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if not isinstance(node, _ALIKE):
            raise UnlikeError
        return super().generic_visit(node)
