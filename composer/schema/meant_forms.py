"""Names of types and behaviours in a wrong form → the form that was meant."""

from __future__ import annotations

import re

_KINDS = ('msg', 'srv', 'action')
_SEPARATORS = re.compile(r'[/.:]+')


def find_meant_form(text: str, pattern: str) -> str | None:
    """Return what a text would be in the form of a pattern of the schema, or `None`.

    Types as other places write them: `std_msgs/String` (ROS 1), `std_msgs.msg.String` (Python),
    `std_msgs::msg::String` (C++); behaviours with a dot, slashes, dashes, `.py` or `()` in them.
    """
    kind = next((kind for kind in _KINDS if f'/{kind}/' in pattern), None)
    form = _as_type(text, kind) if kind else _as_behaviour(text)
    return form if re.search(pattern, form) and form != text else None


def _as_type(text: str, kind: str) -> str:
    package, *middle, name = [*_SEPARATORS.split(text.strip()), '']
    name = middle.pop() if middle else name
    is_other = any(part in _KINDS and part != kind for part in middle)
    return '' if is_other or len(middle) > 1 else f'{package}/{kind}/{name}'


def _as_behaviour(text: str) -> str:
    plain = text.strip().removesuffix('()').replace('-', '_').replace('::', ':')
    module, _, function = plain.rpartition(':')
    if not module:
        module, _, function = function.rpartition('.')
    return f'{module.removesuffix(".py").replace("/", ".")}:{function}'
