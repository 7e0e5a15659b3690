"""Finds the systems that run on this ROS graph."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.application.running_systems import answer_forms
from composer.application.running_systems.client import RunningSystem, wait_until
from composer.errors import ComposerError, UsageError
from composer.runtime.control import protocol
from composer.runtime.control.name_claim import find_address, list_claims
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from composer.application.running_systems.client import Client

# How long systems on other hosts may take to be found, and those that are on this one for sure.
_SEARCH_SEC = 1.0
_LOCAL_SEARCH_SEC = 10.0


class Discovery:
    """The systems that a client sees."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._domain_id = client.domain_id

    def find_all(self) -> list[RunningSystem]:
        """Return the systems on this ROS graph, by their names; what is far may need a second."""
        self._search(lambda _found: False)
        return self._ask_status(self._list_control_nodes())

    def find_silent(self, found: Iterable[RunningSystem]) -> list[int]:
        """Return the processes of systems on this host that were not found: they say nothing."""
        known = {find_address(_last(each.node), self._domain_id) for each in found}
        claims = list_claims(self._domain_id)
        return [
            each['pid'] for each in claims if 'name' not in each and each['address'] not in known
        ]

    def find(self, name: str | None) -> RunningSystem:
        """Return the system of this name; without one, the only system that there is.

        Raises:
            ComposerError: There is none, or it cannot be asked.
            UsageError: There are several.
        """
        if name is not None:
            wanted = protocol.node_name(name)
            self._search(lambda found: any(_last(node) == wanted for node in found))
            for node in self._list_control_nodes():
                if _last(node) == wanted:
                    (system,) = self._ask_status([node])
                    return replace(system, name=name)
            systems = self._ask_status(self._list_control_nodes())
        else:
            systems = self.find_all()
        if name is None and len(systems) == 1:
            return systems[0]
        raise self._explain(name, [each.name for each in systems])

    def find_process(self, system: RunningSystem) -> int | None:
        """Return the process of a system on this host; `None` for one on another."""
        return self._list_local().get(_last(system.node))

    def is_there(self, system: RunningSystem) -> bool:
        """Return whether a system is on the graph."""
        return system.node in self._list_control_nodes()

    def _ask_status(self, nodes: Sequence[str]) -> list[RunningSystem]:
        """Return systems by their names with what they say."""
        texts = self._client.ask_all([f'{node}/{protocol.STATUS}' for node in nodes])
        systems = [_read_status(node, text) for node, text in zip(nodes, texts, strict=True)]
        return sorted(systems, key=lambda each: (each.name, each.node))

    def _search(self, is_enough: Callable[[list[str]], bool]) -> None:
        """Wait until systems had the time to be found."""
        begun = time.monotonic()
        local = self._list_local()

        def is_over() -> bool:
            found = self._list_control_nodes()
            if is_enough(found):
                return True
            has_all = local.keys() <= {_last(node) for node in found}
            return has_all and time.monotonic() > begun + _SEARCH_SEC

        wait_until(is_over, _LOCAL_SEARCH_SEC)

    def _list_local(self) -> dict[str, int]:
        """Return the control nodes and processes of the systems here that can be asked."""
        claims = list_claims(self._domain_id)
        return {
            protocol.node_name(str(each['name'])): each['pid']
            for each in claims
            if each.get('is_asked')
        }

    def _list_control_nodes(self) -> list[str]:
        nodes = map(protocol.find_control_node, self._client.list_services())
        return sorted(filter(None, nodes))

    def _explain(self, name: str | None, names: list[str]) -> ComposerError:
        domain = f'ROS_DOMAIN_ID {self._domain_id}'
        if name is None and names:
            message = f'several systems run on this ROS graph ({domain})'
            return UsageError(message, help=f'name one of them: {", ".join(names)}')
        claims = list_claims(self._domain_id)
        if name in [each.get('name') for each in claims if not each.get('is_asked', True)]:
            message = f"system '{name}' was started with --no-control, and cannot be asked"
            return ComposerError(message)
        silent = {each['address']: each['pid'] for each in claims if 'name' not in each}
        address = find_address(protocol.node_name(name or ''), self._domain_id)
        if name and address in silent:
            return ComposerError(f"system '{name}' (pid {silent[address]}) does not answer")
        advice = suggest(name, names, 'there are') if name else None
        if silent:
            advice = f'process {min(silent.values())} runs a system, and does not answer'
        what = f"there is no system '{name}'" if name else 'no system runs'
        return ComposerError(f'{what} on this ROS graph ({domain})', help=advice)


def _read_status(node: str, text: str | None) -> RunningSystem:
    """Return the system at a control node, which anybody may have created."""
    name = _last(node).removeprefix(protocol.node_name(''))
    if text is None:
        return RunningSystem(name, node, None, 'no answer')
    try:
        status = answer_forms.read_answer(text, answer_forms.STATUS)
    except ComposerError:
        return RunningSystem(name, node, None, 'unknown answer')
    if protocol.node_name(status['name']) != _last(node):
        return RunningSystem(name, node, None, 'wrong name')
    return RunningSystem(status['name'], node, status)


def _last(node: str) -> str:
    return node.rpartition('/')[2]
