from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Literal

from std_msgs.msg import ColorRGBA
from typing_extensions import assert_never

if TYPE_CHECKING:
    from composer import Node
    from test_msgs.srv import BasicTypes


class Phase(enum.IntEnum):
    DOCKED = 0
    LEAVING = enum.auto()
    FREE = enum.auto()

    @property
    def colour(self) -> ColorRGBA:
        match self:
            case Phase.DOCKED:
                rgb = (0, 1, 0)
            case Phase.LEAVING:
                rgb = (1, 1, 0)
            case Phase.FREE:
                rgb = (0.2, 0.2, 0.2)
            case _:
                assert_never(self)
        return ColorRGBA(**dict(zip('rgb', map(float, rgb))), a=1.0)


def begin(node: Node) -> None:
    node.state.phase = Phase.DOCKED
    node.state.count = 0


def tick(node: Node) -> int:
    match node.state.phase, node.state.count:
        case Phase.DOCKED, n if n >= node.parameters.undock_after:
            node.state.phase = Phase.LEAVING
        case Phase.LEAVING, _:
            node.state.phase = Phase.FREE
        case (Phase.FREE | Phase.DOCKED), _:
            pass
    node.state.count += 1
    node.publish('lamp', node.state.phase.colour)
    return node.state.phase.value


def command(node: Node, request: BasicTypes.Request) -> BasicTypes.Response | dict[str, object]:
    match request.string_value.split():
        case ['dock']:
            node.state.phase, node.state.count = Phase.DOCKED, 0
            return {'bool_value': True}
        case ['phase', ('get' | 'read')]:
            return {'int32_value': node.state.phase, 'string_value': node.state.phase.name}
        case [unknown, *rest] if rest:
            return {'string_value': f'{unknown} takes no {rest!r}'}
    return {}


def ask(node: Node):
    text: Literal['dock', 'phase get', 'jump high', ''] = ''
    for text in ('phase get', 'dock', 'jump high', ''):
        answer = node.call('command', {'string_value': text})
        node.logger.info(f'{text!r}: {answer.bool_value} {answer.int32_value} {answer.string_value}')
        yield
