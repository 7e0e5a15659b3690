"""How the nodes of a system stop: nothing new begins, `on_stop` is heard, what runs may end."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from composer.python_source import FunctionKind
from composer.runtime.behaviours import kind_of
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from composer.runtime.live_node import LiveNode


def stop_nodes(nodes: list[LiveNode], timeout_sec: float) -> bool:
    """Let all behaviours end, at the same time in all nodes.

    A node's `on_stop` is called when its behaviours have ended, and after half the time if they
    have not: what must be switched off is switched off even beside a callback that hangs.
    Services of nodes without an `on_stop` answer until all of them have ended.

    Returns:
        Whether all of them ended in time; the stacks of those that did not have been logged.
    """
    deadline = time.monotonic() + timeout_sec
    for node in nodes:
        node.gate.is_open = False
        for timer in node.timers:
            timer.cancel()
    hooks = [
        threading.Thread(target=_run_on_stop, args=(node, timeout_sec), daemon=True)
        for node in reversed(nodes)
        if node.spec.on_stop and node.has_begun
    ]
    for thread in hooks:
        thread.start()
    for thread in hooks:
        thread.join(max(deadline - time.monotonic(), 0.0))
    for node in nodes:
        node.gate.close()
    ended = [_wait_until_idle(node, deadline) for node in nodes]
    return all(ended) and not any(thread.is_alive() for thread in hooks)


def _run_on_stop(node: LiveNode, timeout_sec: float) -> None:
    hook = node.spec.on_stop
    if hook is None:
        return
    node.ledger.wait_until_idle(timeout_sec / 2)
    node.gate.serves = False
    node.waits.allow()
    call = node.hook('on_stop', hook)
    if kind_of(node.function(hook)) is FunctionKind.COROUTINE:
        done = threading.Event()
        task = node.services.executor.create_task(
            call.as_callback(FunctionKind.COROUTINE), node.face
        )
        task.add_done_callback(lambda _task: done.set())
        done.wait(timeout_sec)
    else:
        call.run(node.face)


def _wait_until_idle(node: LiveNode, deadline: float) -> bool:
    if node.ledger.wait_until_idle(max(deadline - time.monotonic(), 0.0)):
        return True
    for call in node.ledger.running():
        system_logger.error(
            f"node '{node.spec.name}': {call.owner} did not end in time; it is at\n"
            f'{call.format_stack()}'
        )
    return False
