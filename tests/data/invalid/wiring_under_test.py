"""Behaviours that the files with findings of wiring name."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Generator

    from geometry_msgs.msg import Twist
    from std_msgs.msg import Int32, String
    from std_srvs.srv import SetBool

    from composer import Node


def hear(node: Node, message: String) -> None:
    node.logger.info(f'{message.data}')


def answer(node: Node, message: String) -> str:
    return f'You said {message.data}'


def count(node: Node) -> Int32: ...


def count_up(node: Node) -> Generator[Int32, None, None]:
    yield


def measure(node: Node) -> float:
    return 0.5


def swap(message: String, node: Node) -> None: ...


def bare(node: Node, message: str) -> None: ...


def drive(node: Node, message: Twist) -> None: ...


def serve(node: Node, request: SetBool.Response) -> SetBool.Response: ...


def set_it(node: Node, request: SetBool.Request) -> dict[str, object]:
    return {'success': True}


def tell(node):
    node.publish('status', 'alive')
    report(node)


def report(face):
    face.publish('sttus', 'alive')


def ask(node):
    node.call('set_it', True)
    node.call('set', True)


def relay(node, request):
    return node.call('set_it', request)


async def ask_later(node):
    await node.call_async('set_it', True)


def ask_beside(node):
    threading.Thread(target=lambda: node.call('set_it', True)).start()


def send(node):
    node.send_goal('fibonacci', 3)
    node.send_goal('fibonaci', 3)


def read(node):
    return [node.parameters.speed, node.parameters['sped'], node.parameters.get('sped_limit')]


def pass_on(node):
    threading.current_thread().node = node
