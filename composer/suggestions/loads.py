"""What a split is computed from: what nodes cost, and which messages go between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

# Whoever waits for a core gets some of it.
_LEAST_CORES = 0.1


@record
class NodeLoad:
    """What a node used while it was measured.

    Attributes:
        name: Its full name.
        cpu: How many processors its calls used on average.
        worker: Where it ran: a worker, or `''` for the process of the system.
        is_measured: Whether there are figures of it.
    """

    name: str
    cpu: float
    worker: str = ''
    is_measured: bool = True


@record
class Flow:
    """Messages that one node gets from another.

    Attributes:
        topic: The full name of the topic, or of the service.
        source: The full name of the node that sends.
        sink: That of the node that gets them.
        rate_hz: How many came in a second.
        size: Of a message, in bytes.
        is_local: Whether they are handed over within a process.
    """

    topic: str
    source: str
    sink: str
    rate_hz: float
    size: float
    is_local: bool = True


@record
class SystemLoad:
    """All that was measured of a system.

    Attributes:
        cores: How many processor cores there are.
        demand: How many times as much there is to do as was done: 1 if nothing was late, infinite
            if that cannot be known.
        together: Groups of nodes that must be in one process, by full names.
        fixed: Nodes that must stay where they are.
        taken: Names that new workers must not have.
        others: How many of the cores other programs use; 0 if that is not known.
    """

    nodes: Sequence[NodeLoad]
    flows: Sequence[Flow]
    cores: int
    demand: float = float('inf')
    together: Sequence[frozenset[str]] = ()
    fixed: frozenset[str] = frozenset()
    taken: frozenset[str] = frozenset()
    others: float = 0.0

    @property
    def free_cores(self) -> float:
        """How many cores are left to the system: no fewer than it used."""
        used = sum(node.cpu for node in self.nodes)
        return min(self.cores, max(self.cores - self.others, used, _LEAST_CORES))

    @property
    def present(self) -> Mapping[str, str]:
        """The worker of each node, as the system was measured."""
        return {node.name: node.worker for node in self.nodes}
