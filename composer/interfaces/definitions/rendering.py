"""Write interfaces in the notation of definition files."""

from collections.abc import Iterator

from composer.interfaces.definitions.statements import SEPARATOR
from composer.interfaces.descriptions import InterfaceDescription, MessageDescription


def render_definition(interface: InterfaceDescription, *, comments: bool) -> Iterator[str]:
    """Yield the lines of an interface's definition, with or without its comments."""
    for index, part in enumerate(interface.parts):
        if index:
            yield SEPARATOR
        for line in _render_message(part):
            if comments or not line.startswith('#'):
                yield line


def _render_message(message: MessageDescription) -> Iterator[str]:
    yield from _render_comment(message.comment)
    for constant in message.constants:
        yield from _render_comment(constant.comment)
        yield f'{constant.type} {constant.name}={_render_value(constant.value)}'
    for field in message.fields:
        yield from _render_comment(field.comment)
        default = '' if field.default is None else f' {_render_value(field.default)}'
        yield f'{field.type} {field.name}{default}'


def _render_comment(comment: str) -> Iterator[str]:
    for line in comment.splitlines():
        yield f'# {line}'.rstrip()


def _render_value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f'[{", ".join(map(_render_value, value))}]'
    return repr(value) if isinstance(value, str) else str(value)
