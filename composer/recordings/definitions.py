"""The definitions of recorded types: a message with all that it refers to, in one text.

As rosbag2 writes them (`local_message_definition_source.cpp`): the text of the `.msg` file, then
that of each type in it after a line of 80 `=` and one with its name.
"""

from __future__ import annotations

import json
import re
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import (
    InterfaceNotFoundError,
    import_interface,
    interface_name,
    is_message_class,
)
from composer.interfaces.definitions.rendering import render_definition

if TYPE_CHECKING:
    from collections.abc import Iterator

ENCODING: Final = 'ros2msg'
_SEPARATOR: Final = '=' * 80
# The type of a field, without what makes it an array or a bounded string; or that of a constant.
_FIELD: Final = re.compile(r'^[ \t]*([A-Za-z]\w*(?:/\w+){0,2})(?=[ \t<\[])', re.MULTILINE)
_CHAR: Final = re.compile(r'^([ \t]*)char(?=[ \t<\[])', re.MULTILINE)
_PRIMITIVES: Final = frozenset(
    (
        *('bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring'),
        *(f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)),
    )
)


def import_message(full_name: str) -> type:
    """Import the class of a message; also that of a part of an action or a service.

    Raises:
        InterfaceNotFoundError: It does not exist, or cannot be loaded.
    """
    package, kind, name = [*full_name.split('/'), '', ''][:3]
    whole, _, part = name.partition('_')
    if kind != 'action' or not part:
        found: Any = import_interface(full_name)
    else:
        action: Any = import_interface(f'{package}/{kind}/{whole}')
        found = getattr(action, part, None) or getattr(action.Impl, part, None)
    if found is None or not is_message_class(found):
        message = f'{full_name} is not a message'
        raise InterfaceNotFoundError(message)
    message_class: type = found
    return message_class


@cache
def full_definition(message_class: type) -> str:
    """Return the definition of a message and of all types in it.

    Raises:
        ComposerError: It has a field of a type that `.msg` files do not have.
    """
    known: set[str] = {interface_name(message_class)}
    return ''.join(_define(message_class, known))


def _define(message_class: type, known: set[str]) -> Iterator[str]:
    name = interface_name(message_class)
    text = _read_definition(message_class)
    yield text
    for used in sorted(_used_types(text, name.partition('/')[0])):
        if used not in known:
            known.add(used)
            yield f'\n{_SEPARATOR}\nMSG: {used.replace("/msg/", "/")}\n'
            yield from _define(import_message(used), known)


def _used_types(text: str, package: str) -> set[str]:
    """Return the full names of the messages that a definition refers to."""
    found = set()
    for name in _FIELD.findall(text):
        if '/' not in name and name in _PRIMITIVES:
            continue
        *owner, short = name.split('/')
        kind = owner[1] if len(owner) > 1 else 'msg'
        found.add(f'{owner[0] if owner else package}/{kind}/{short}')
    return found


def _read_definition(message_class: type) -> str:
    """Return the text of the file that defines a message; what its class says if there is none.

    Parts of actions and services have none of their own.
    """
    name = interface_name(message_class)
    path = _find_share(name.partition('/')[0]) / name.partition('/')[2]
    try:
        text = path.with_suffix('.msg').read_text(encoding='utf-8')
    except OSError:
        lines = render_definition(describe_class(message_class), comments=False)
        return ''.join(f'{line}\n' for line in lines)
    # The same by its other name: for rosbags, a char is of another type, and so of another hash.
    return _CHAR.sub(r'\1uint8', text)


@cache
def _find_share(package: str) -> Path:
    """Return the share folder beside the Python module of an interface package."""
    origin = sys.modules[package].__file__ or ''
    shares = (parent / 'share' / package for parent in Path(origin).parents)
    return next((each for each in shares if each.is_dir()), Path(origin).parent)


@cache
def type_hash(message_class: type) -> str:
    """Return the hash of a type (REP 2016) as `RIHS01_…`; empty if its package has none."""
    name = interface_name(message_class)
    path = _find_share(name.partition('/')[0]) / name.partition('/')[2]
    # Those of the parts of an action are in the file of the action.
    for candidate in (path, path.with_name(path.name.partition('_')[0])):
        try:
            document: dict[str, Any] = json.loads(candidate.with_suffix('.json').read_bytes())
            hashes = {each['type_name']: each['hash_string'] for each in document['type_hashes']}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if name in hashes:
            return str(hashes[name])
    return ''
