"""A picture as one JSON document, for other programs; `docs/drawing.md` describes it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.diagnostics import describe_finding, relative_path

if TYPE_CHECKING:
    from composer.drawing.picture import Edge, Part, Picture

_VERSION = 1


def render_json(picture: Picture) -> str:
    """Return a picture as one JSON document."""
    return json.dumps(describe_picture(picture), indent=2) + '\n'


def describe_picture(picture: Picture) -> dict[str, Any]:
    """Return a picture as plain data, of the form that `docs/drawing.md` gives."""

    def describe(part: Part, names: str = '', **more: Any) -> dict[str, Any]:
        """Return some attributes of a part, and its place."""
        source = (span := picture.positions.key(part.path)).source
        # A value of --set is in no file.
        file = relative_path(source.name) if source.home is None else source.name
        attributes = {name: getattr(part, name) for name in names.split()}
        return attributes | more | {'file': file, 'line': span.line}

    def describe_edge(edge: Edge) -> dict[str, Any]:
        names = 'id name type qos by_parameter findings role'
        ids = {'node': edge.node.id, 'channel': edge.channel.id}
        ways = {'from': edge.start.id, 'to': edge.end.id}
        delivery = {'delivery': edge.delivery.way, 'delivery_reason': edge.delivery.reason}
        return describe(edge, names, **ids, **ways, **delivery)

    about_nodes = 'id kind name namespace description findings'
    about_channels = 'id kind name external findings'
    return {
        'version': _VERSION,
        'name': picture.name,
        'description': picture.description,
        'nodes': [
            describe(node, about_nodes, host=node.place[0], worker=node.place[1])
            for node in picture.nodes
        ],
        'channels': [
            describe(channel, about_channels, types=channel.details)
            for channel in picture.channels
        ],
        'edges': [describe_edge(edge) for edge in picture.edges],
        'waits': [
            describe(wait, node=wait.end.id, **{'for': wait.start.id}) for wait in picture.waits
        ],
        'findings': [describe_finding(finding) for finding in picture.findings],
    }
