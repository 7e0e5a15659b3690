"""Names as a scenario file has them → full names."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import NodeSpec


class NameReader:
    """Reads the names of one file.

    Args:
        nodes: The nodes of the system, by their keys.
    """

    def __init__(self, nodes: Mapping[str, NodeSpec]) -> None:
        self._full_names = {key: node.full_name for key, node in nodes.items()}

    def node(self, name: str) -> str:
        """Return the full name of a node: it may be named as in the file of the system."""
        return self._full_names.get(name) or absolute(name)


def absolute(name: str) -> str:
    """Return a name from the root: `scan` is `/scan`."""
    return name if name.startswith('/') else f'/{name}'
