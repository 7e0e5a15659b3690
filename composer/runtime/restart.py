"""What happens when a behaviour raises, as `on_error` says; above all, restarts of nodes."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.processes.backoff import Backoff
from composer.runtime.logs import set_level, system_logger
from composer.runtime.stop import stop_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import OnError
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.runtime.start import Starter

_GONE_SEC = 2.0


class ErrorPolicy:
    """Does what `on_error` says when a behaviour raises.

    Args:
        restart: Rebuilds the node of this name.
        shutdown: Ends the system with this exit code.
    """

    def __init__(self, restart: Callable[[str], object], shutdown: Callable[[int], None]) -> None:
        self._restart = restart
        self._shutdown = shutdown
        self._backoffs: dict[str, Backoff] = {}
        self._restarting: set[str] = set()
        self._lock = threading.Lock()
        self._stopped = threading.Event()

    def act(self, node: str, on_error: OnError) -> None:
        """Do what `on_error` says about an error of a node."""
        if on_error == 'shutdown':
            self._shutdown(1)
        elif on_error == 'restart':
            with self._lock:
                if node in self._restarting:
                    return
                self._restarting.add(node)
            # The behaviour that raised is one of the node's callbacks: it must end first.
            threading.Thread(
                target=self._restart_later, args=(node,), name=f'restart-{node}', daemon=True
            ).start()

    def stop(self) -> None:
        """Restart no more nodes."""
        self._stopped.set()

    def _restart_later(self, node: str) -> None:
        backoff = self._backoffs.setdefault(node, Backoff())
        stopped = self._stopped.wait(backoff.next_delay_sec())
        with self._lock:
            self._restarting.discard(node)
        if not stopped:
            self._restart(node)


class NodeRestarter:
    """Rebuilds nodes, one at a time.

    Args:
        nodes: The nodes of the system, by their full names.

    Attributes:
        lock: Held while a node is rebuilt, for nothing to stop an incomplete node.
        left: The nodes that were removed although something in them hung.
    """

    def __init__(
        self,
        nodes: dict[str, LiveNode],
        starter: Starter,
        system: SystemHandle,
    ) -> None:
        self.lock = threading.Lock()
        self.left: list[LiveNode] = []
        self._nodes = nodes
        self._starter = starter
        self._system = system

    def restart(self, full_name: str) -> str:
        """Rebuild a node: its entities, parameters and state are as at the start again.

        A node that hangs is left as it is. If the new one cannot start, that counts as an error of
        the node, after which it is restarted again.

        Returns:
            Why it was not restarted; empty if it was.
        """
        with self.lock:
            old = self._nodes.get(full_name)
            if old is None:
                return f"there is no node '{full_name}' any more"
            if self._system.stop.is_set or not self._end(old):
                if self._system.stop.is_set:
                    return 'the system stops'
                text = f"node '{old.spec.key}' hangs, and is left as it is: {_list_calls(old)}"
                system_logger.error(text)
                return text
            try:
                self.build(old)
            except ComposerError as error:
                system_logger.error(f'restart: {error}')
                self._system.act_on_error(full_name, 'restart')
                return str(error)
        system_logger.warning(f"node '{old.spec.key}' was restarted")
        return ''

    def remove(self, full_name: str) -> None:
        """Stop and remove a node, also one that hangs."""
        if self._end(self._nodes[full_name]):
            del self._nodes[full_name]
        else:
            self.leave(full_name)

    def make_way(self, full_name: str) -> bool:
        """Stop and remove a node for another one; return whether it is gone.

        One whose behaviours hang stays as it is; one whose `on_stop` hangs could do no more.
        """
        node = self._nodes[full_name]
        if self._end(node):
            del self._nodes[full_name]
        elif not node.gate.is_open:
            self.leave(full_name)
        return full_name not in self._nodes

    def leave(self, full_name: str) -> None:
        """Remove a node that hangs; only the thread of what hangs is left."""
        if self._system.stop.is_set:
            return
        node = self.drop(full_name)
        self.left.append(node)
        system_logger.error(f"node '{node.spec.key}' hangs, and is removed: {_list_calls(node)}")

    def drop(self, full_name: str) -> LiveNode:
        """Remove a node at once, without its `on_stop`, and return it."""
        node = self._nodes.pop(full_name)
        node.gate.close()
        self._system.executor.remove_node(node.ros)
        node.destroy()
        return node

    def build(self, old: LiveNode) -> None:
        """Build a node that was removed, and start it."""
        (node,) = self._starter.create([old.spec])
        self._system.executor.add_node(node.ros)
        self._starter.run_on_start(node)
        self._starter.open([node])
        node.ros.start_parameter_services()

    def _end(self, node: LiveNode) -> bool:
        """Remove a node; return whether a new one may take its place."""
        stop, executor, name = self._system.stop, self._system.executor, node.spec.key
        has_ended = stop_node(node, self._system.stop_timeout_sec, lambda: stop.is_set)
        if stop.is_set:
            return False
        if not has_ended:
            executor.wake()
            return False
        executor.remove_node(node.ros)
        node.destroy()
        set_level(node.spec, self._system.log_levels, exists=False)
        if not node.ros.wait_until_gone(_GONE_SEC):
            system_logger.warning(
                f"node '{name}': something still holds an entity of the node from before its "
                'restart, so its log may be missing on /rosout'
            )
        return True


def _list_calls(node: LiveNode) -> str:
    return ', '.join(str(call.owner) for call in node.running.calls())
