"""Events and messages as text, one line each: the same on every machine.

Numbers have all their digits: the shortest ones that give the same float again, of 32 bits where
the field has 32. Text is as in JSON, special numbers are as in YAML (`.nan`, `-.inf`). Arrays of
more than 64 bytes are base64.
"""

from __future__ import annotations

import math
import re
from base64 import b64encode
from json.encoder import encode_basestring, encode_basestring_ascii
from operator import attrgetter
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from composer.simulation.events import Event

Renderer: TypeAlias = 'Callable[[Any], str]'

_NANOSECONDS = 1_000_000_000
_FLOAT32 = 'float'
_BYTES = ('octet', 'uint8', 'int8', 'char')
# Longer arrays of bytes are images and the like: nobody reads them as numbers.
_MOST_BYTES_SHOWN = 64
_SPECIAL = {'nan': '.nan', 'inf': '.inf', '-inf': '-.inf'}
# What a traceback says before the error itself; in a log it may be indented.
_FRAMES = re.compile(r'^( *)Traceback .*\n(?:\1 +.*\n)*', re.MULTILINE)


def render_event(event: Event) -> str:
    """Return an event as one line: time, kind, node, name and value; `-` for what it lacks."""
    seconds, rest = divmod(event.time_ns, _NANOSECONDS)
    value = event.value
    if event.kind == 'error':
        value = error_line(value)
    elif event.kind == 'log':
        # Frames name files of this machine.
        value = _FRAMES.sub('', value)
    return (
        f'{seconds}.{rest:09d} {event.kind} {event.node or "-"} {event.name or "-"} '
        f'{render_value(value)}'
    )


def render_value(value: Any) -> str:
    """Return a message, or plain data, as one line of YAML in its flow form."""
    kind = type(value)
    renderer = _RENDERERS.get(kind)
    if renderer is None:
        renderer = _RENDERERS[kind] = _create_renderer(kind)
    return renderer(value)


def error_line(traceback: str) -> str:
    """Return the error of a traceback in one line: without frames, which name files, and notes."""
    *_, last = _FRAMES.split(f'\n{traceback}')
    return last.strip().partition('\n')[0]


def _create_renderer(kind: type) -> Renderer:
    """Return the renderer for the values of a class; there is one for each."""
    if hasattr(kind, 'get_fields_and_field_types'):
        return _create_message_renderer(kind)
    if issubclass(kind, dict):
        return _render_mapping
    if hasattr(kind, 'tolist'):
        return _render_array
    for base in (bool, int, float, str, bytes):
        # As an enumeration of integers is.
        if issubclass(kind, base):
            return lambda value: _RENDERERS[base](base(value))
    if issubclass(kind, set | frozenset):
        return lambda value: _join(sorted(map(render_value, value)))
    # Its own text may hold an address.
    return lambda _: f'<{kind.__name__}>'


def _create_message_renderer(kind: Any) -> Renderer:
    fields: dict[str, str] = kind.get_fields_and_field_types()
    parts = [
        (f'{name}: ', attrgetter(name), _renderer_of_field(type_name))
        for name, type_name in fields.items()
    ]
    if len(parts) == 1:
        ((start, get, render),) = parts
        return lambda message: f'{{{start}{render(get(message))}}}'

    def render_message(message: Any) -> str:
        return f'{{{", ".join([start + render(get(message)) for start, get, render in parts])}}}'

    return render_message


def _renderer_of_field(type_name: str) -> Renderer:
    """Return the renderer for a type as `get_fields_and_field_types` names it."""
    if type_name in _OF_SCALARS:
        return _OF_SCALARS[type_name]()
    item = type_name.removeprefix('sequence<').split('<')[0].split('[')[0].split(',')[0]
    if not (type_name.startswith('sequence<') or type_name.endswith(']')):
        return render_value
    item = item.rstrip('>')
    if item == _FLOAT32:
        return _create_float32_renderer(is_array=True)
    return _render_bytes if item in _BYTES else _render_array


def _create_float32_renderer(*, is_array: bool = False) -> Renderer:
    # The messages themselves need it; without ROS there may be none.
    import numpy as np

    def render_items(value: Any) -> str:
        texts: list[str] = np.asarray(value, np.float32).astype(str).tolist()
        return _join([_SPECIAL.get(text, text) for text in texts])

    def render(value: float) -> str:
        with np.errstate(over='ignore'):
            text = str(np.float32(value))
        return _SPECIAL.get(text, text)

    return render_items if is_array else render


def _items(value: Any) -> Iterable[Any]:
    items: Iterable[Any] = value.tolist() if hasattr(value, 'tolist') else value
    return items


def _join(items: Iterable[str]) -> str:
    return f'[{", ".join(items)}]'


def _render_array(value: Any) -> str:
    return _join(map(render_value, _items(value)))


def _render_bytes(value: Any) -> str:
    if len(value) <= _MOST_BYTES_SHOWN:
        return _join(map(render_value, _items(value)))
    is_joined = isinstance(value, bytes | bytearray) or hasattr(value, 'tobytes')
    if not is_joined:
        value = b''.join(each if isinstance(each, bytes) else _as_byte(each) for each in value)
    content = value.tobytes() if hasattr(value, 'tobytes') else bytes(value)
    return f'!!binary {b64encode(content).decode()}'


def _as_byte(number: int) -> bytes:
    return bytes((number & 0xFF,))


def _render_float(value: float) -> str:
    if value - value == 0:
        return repr(value)
    if math.isnan(value):
        return '.nan'
    return '.inf' if value > 0 else '-.inf'


def _render_text(value: str) -> str:
    # Nothing else keeps it on one line, and every terminal and file takes it.
    return encode_basestring(value) if value.isprintable() else encode_basestring_ascii(value)


def _render_mapping(value: dict[Any, Any]) -> str:
    parts = (f'{_render_key(key)}: {render_value(each)}' for key, each in value.items())
    return f'{{{", ".join(parts)}}}'


def _render_key(key: Any) -> str:
    return key if isinstance(key, str) and key.isidentifier() else render_value(key)


_RENDERERS: dict[type, Renderer] = {
    bool: lambda value: 'true' if value else 'false',
    bytes: lambda value: str(value[0]) if len(value) == 1 else _render_bytes(value),
    bytearray: _render_bytes,
    dict: _render_mapping,
    float: _render_float,
    int: str,
    list: _render_array,
    str: _render_text,
    tuple: _render_array,
    type(None): lambda _: 'null',
}

_OF_SCALARS: dict[str, Callable[[], Renderer]] = {
    'string': lambda: _render_text,
    'wstring': lambda: _render_text,
    'double': lambda: _render_float,
    _FLOAT32: _create_float32_renderer,
}
