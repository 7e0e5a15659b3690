"""A picture as one JSON document, for other programs.

```
{
  "version": 1,                raised when a key is removed or changes its meaning
  "name", "description",       of the system
  "nodes": [                   nodes and external processes
    {"id": "node:/robot/arm", "kind": "node" | "process", "name", "namespace", "description",
     "host", "worker",                      where it runs; empty where the file does not say
     "findings": [0], "file", "line"}],
  "channels": [                topics, services, actions
    {"id": "topic:/robot/scan", "kind": "topic" | "service" | "action", "name",
     "types": ["sensor_msgs/msg/LaserScan"],
     "external": ["providers" | "users"],   which ends are outside the system: publishers
                                            and servers, or subscriptions and clients
     "findings", "file", "line"}],
  "edges": [                   publishers, subscriptions, servers and clients
    {"id": "publisher:/robot/arm:scan", "role": its kind, as in "publisher" or
     "service client"; "service server" and "action server", "name", "node": <id>, "channel": <id>,
     "from": <id>, "to": <id>,              the way of messages, requests and goals
     "type", "qos": {"depth": 5},           policies that differ from the default; durations in s
     "delivery": "local" | "sent" | "both" | "",   whether messages, calls and goals are handed
                                            over within the process; empty without another end
     "delivery_reason": "durability: transient_local",   why they are sent; "other worker" and
                                            "other host" for what crosses
     "by_parameter": {"topic": "prefix"},   what follows which parameter of the node
     "findings", "file", "line"}],
  "waits": [{"node": <id>, "for": <id>, "file", "line"}],
  "findings": [                those of `composer check`; above they are indices into this list
    {"rule", "severity": "error" | "warning", "message", "help", "file", "line", "column"}]
}
```

Everything is in the order of the files. `file` is relative to the working folder if it lies in
it; `line` and `column` count from 1, and are null where a finding has none.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.diagnostics import describe_finding, relative_path

if TYPE_CHECKING:
    from composer.drawing.picture import Box, Edge, Picture, Wait

_VERSION = 1


def render_json(picture: Picture) -> str:
    """Return a picture as one JSON document."""
    return json.dumps(describe_picture(picture), indent=2) + '\n'


def describe_picture(picture: Picture) -> dict[str, Any]:
    """Return a picture as plain data, of the form that this module's docstring gives."""

    def describe(part: Box | Edge | Wait, names: str = '', **more: Any) -> dict[str, Any]:
        """Return some attributes of a part, and its place."""
        source = (span := picture.positions.key(part.path)).source
        # A value of --set is in no file.
        file = relative_path(source.name) if source.home is None else source.name
        attributes = {name: getattr(part, name) for name in names.split()}
        return attributes | more | {'file': file, 'line': span.line}

    def describe_edge(edge: Edge) -> dict[str, Any]:
        names = 'id name node channel type qos by_parameter findings'
        ways = dict(zip(('from', 'to'), edge.ends, strict=True))
        delivery = {'delivery': edge.delivery.way, 'delivery_reason': edge.delivery.reason}
        return describe(edge, names, role=edge.kind, **ways, **delivery)

    about_nodes = 'id kind name namespace description findings'
    about_channels = 'id kind name types external findings'
    return {
        'version': _VERSION,
        'name': picture.name,
        'description': picture.description,
        'nodes': [
            describe(node, about_nodes, host=node.place[0], worker=node.place[1])
            for node in picture.nodes
        ],
        'channels': [describe(channel, about_channels) for channel in picture.channels],
        'edges': [describe_edge(edge) for edge in picture.edges],
        'waits': [
            describe(wait, node=wait.waiter, **{'for': wait.target}) for wait in picture.waits
        ],
        'findings': [describe_finding(finding) for finding in picture.findings],
    }
