"""Settings: changes of single values, as the last layer of a file; `--set` gives them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import SourceFile, Span
from composer.entity_kinds import KIND_OF_SECTION
from composer.errors import ComposerError, UsageError
from composer.language.layers import is_null_a_value
from composer.records import record
from composer.spelling import suggest
from composer.yaml_text.document import Document
from composer.yaml_text.reader import parse_document

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.yaml_text.positions import DataPath

# Sections whose keys are names that the file gives; all other keys are those of the schema.
# `workers` is not among them: a worker may have its name from a node of any file.
_NAMED = frozenset(
    ('args', 'containers', 'hosts', 'include', 'interfaces', 'nodes', 'processes', 'qos', 'vars')
)


@record
class Setting:
    """A change of a single value.

    Attributes:
        path: As in `nodes.talker.timers.tick.period`.
        value: The new value; `None` removes the old one.
        path_span: Where the path is written.
        value_span: Where the value is written.
    """

    path: str
    value: Any
    path_span: Span
    value_span: Span


class SettingError(ComposerError):
    """A setting has no value, or its path leads nowhere."""


def apply_set_values(document: Document, set_values: Sequence[str]) -> Document:
    """Return a document with single values changed; they are typed as in a file.

    Args:
        set_values: As in `nodes.talker.timers.tick.period=0.1`; `null` removes.

    Raises:
        UsageError: An entry has no value, or its path leads nowhere.
    """
    if document.data is None:
        return document
    for set_value in set_values:
        try:
            document = apply_setting(document, _parse_setting(set_value))
        except SettingError as error:
            message = f'--set {set_value}: {error}'
            raise UsageError(message, help=error.help) from error
    return document


def apply_setting(document: Document, setting: Setting) -> Document:
    """Return a document, which has data, with one value changed.

    Raises:
        SettingError: The path leads nowhere.
    """
    data, positions = document.data or {}, document.positions.copy()
    path = _resolve(setting.path, data)
    if setting.value is None and not is_null_a_value(path):
        _find(path, data)
    data = _changed(data, path, setting.value, keeps_null=is_null_a_value(path))
    positions.remove(path)
    written = setting.path_span
    for depth in range(1, len(path)):
        # What is around the value may be new as well.
        if positions.keys.setdefault(path[:depth], written) is written:
            positions.values[path[:depth]] = written
    positions.keys[path] = written
    positions.values[path] = setting.value_span
    return Document(data, positions, document.diagnostics)


def _parse_setting(set_value: str) -> Setting:
    path, separator, text = set_value.partition('=')
    if not separator or not path:
        message = f"'{set_value}' sets nothing"
        raise SettingError(message, help='write path=value, as in executor.threads=4')
    source = SourceFile(f'--set {set_value}', (set_value,), home='.')
    path_span = Span(source, 1, 1, len(path))
    value_span = Span(source, 1, len(path) + 2, len(text))
    return Setting(path, _parse_value(set_value, text), path_span, value_span)


def _resolve(text: str, data: dict[str, Any]) -> DataPath:
    """Return the path that a text names; keys may contain dots.

    Raises:
        SettingError: Some part of it does not exist, and is no key of the language either.
    """
    path: list[str] = []
    inside: Any = data
    if not text:
        message = 'the path is empty'
        raise SettingError(message, help='write it as in executor.threads')
    rest = text
    while rest:
        if not isinstance(inside, dict):
            message = f"'{'.'.join(path)}' is a value, and has no '{rest}' in it"
            raise SettingError(message, help=_help_for(path, inside))
        key = _longest_key(rest, inside) or rest.partition('.')[0]
        if key not in inside and inside and _has_given_names(path):
            message = f"there is no '{key}' in {'.'.join(path)}"
            raise SettingError(message, help=suggest(key, inside, 'there are'))
        path.append(key)
        rest = rest[len(key) + 1 :]
        inside = inside.get(key, {}) if rest else None
    return tuple(path)


def _find(path: DataPath, data: dict[str, Any]) -> None:
    """Make sure that there is something at a path.

    Raises:
        SettingError: There is nothing to remove.
    """
    inside: Any = data
    for depth, key in enumerate(path):
        if not isinstance(inside, dict) or key not in inside:
            where = f' in {".".join(map(str, path[:depth]))}' if depth else ''
            message = f"there is no '{key}'{where} to remove"
            help_text = suggest(str(key), inside, 'there are') if inside else None
            raise SettingError(message, help=help_text)
        inside = inside[key]


def _help_for(path: list[str], inside: Any) -> str | None:
    if not isinstance(inside, list):
        return None
    return f'give the whole list, as in --set "{".".join(path)}=[first, second]"'


def _has_given_names(path: list[str]) -> bool:
    """Return whether the keys at a path are names that the file gives."""
    match path:
        case [section]:
            return section in _NAMED
        case ['nodes', _, section]:
            return section in KIND_OF_SECTION
        case _:
            return False


def _longest_key(text: str, mapping: dict[str, Any]) -> str | None:
    fitting = [key for key in mapping if text == key or text.startswith(f'{key}.')]
    return max(fitting, key=len, default=None)


def _parse_value(set_value: str, text: str) -> Any:
    document = parse_document(f'value: {text}'.encode(), f'--set {set_value}')
    if document.data is None or document.diagnostics:
        reason = document.diagnostics[0].message if document.diagnostics else 'it is empty'
        raise SettingError(reason)
    return document.data.get('value')


def _changed(
    data: dict[str, Any], path: DataPath, value: Any, *, keeps_null: bool
) -> dict[str, Any]:
    head, *rest = path
    if rest:
        inner = data.get(str(head))
        below = inner if isinstance(inner, dict) else {}
        return data | {str(head): _changed(below, tuple(rest), value, keeps_null=keeps_null)}
    if value is None and not keeps_null:
        return {key: each for key, each in data.items() if key != head}
    return data | {str(head): value}
