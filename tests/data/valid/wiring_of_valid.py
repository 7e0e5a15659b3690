"""Behaviours that use what their nodes declare."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import Int32, String
    from std_srvs.srv import SetBool

    from composer import Node


def measure(node: Node) -> float:
    return node.parameters.speed * node.parameters.get('factor', 1.0)


def tell(node: Node) -> None:
    report(node, 'alive')


def report(node: Node, text: str) -> None:
    node.publish('status', text)


def hear(node: Node, message: String) -> None:
    node.logger.info(message.data)


def set_it(node: Node, request: SetBool.Request) -> dict[str, object]:
    return {'success': request.data}


def ask(node: Node) -> None:
    node.call('ask', payload=True)


def count_down(node: Node, message: Int32) -> int | None:
    return message.data - 1 if message.data else None
