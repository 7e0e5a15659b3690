"""Behaviours that the files with findings of wiring name."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import Int32, String
    from std_srvs.srv import SetBool

    from composer import Node


def hear(node: Node, message: String) -> None:
    node.logger.info(f'{message.data}')


def count(node: Node) -> Int32: ...


def set_it(node: Node, request: SetBool.Request) -> dict[str, object]:
    return {'success': True}


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


def pass_on(node):
    threading.current_thread().node = node
