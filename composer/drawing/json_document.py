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

from composer.diagnostics import relative_path

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.drawing.picture import ChannelBox, Edge, NodeBox, Picture
    from composer.yaml_text.positions import DataPath

_VERSION = 1


def render_picture(picture: Picture) -> str:
    """Return a picture as one JSON document."""
    return json.dumps(describe_picture(picture), indent=2) + '\n'


def describe_picture(picture: Picture) -> dict[str, Any]:
    """Return a picture as plain data, of the form that this module's docstring gives."""
    return {
        'version': _VERSION,
        'name': picture.name,
        'description': picture.description,
        'nodes': [_node(picture, node) for node in picture.nodes],
        'channels': [_channel(picture, channel) for channel in picture.channels],
        'edges': [_edge(picture, edge) for edge in picture.edges],
        'waits': [
            {'node': wait.waiter, 'for': wait.target, **_place_of(picture, wait.path)}
            for wait in picture.waits
        ],
        'findings': [describe_finding(finding) for finding in picture.findings],
    }


def _node(picture: Picture, node: NodeBox) -> dict[str, Any]:
    return {
        'id': node.id,
        'kind': node.kind,
        'name': node.name,
        'namespace': node.namespace,
        'description': node.description,
        'host': node.place[0],
        'worker': node.place[1],
        'findings': list(node.findings),
        **_place_of(picture, node.path),
    }


def _channel(picture: Picture, channel: ChannelBox) -> dict[str, Any]:
    return {
        'id': channel.id,
        'kind': channel.kind,
        'name': channel.name,
        'types': list(channel.types),
        'external': list(channel.external),
        'findings': list(channel.findings),
        **_place_of(picture, channel.path),
    }


def _edge(picture: Picture, edge: Edge) -> dict[str, Any]:
    start, end = edge.ends
    return {
        'id': edge.id,
        'role': edge.role,
        'name': edge.name,
        'node': edge.node,
        'channel': edge.channel,
        'from': start,
        'to': end,
        'type': edge.type,
        'qos': dict(edge.qos),
        'delivery': edge.delivery.way,
        'delivery_reason': edge.delivery.reason,
        'by_parameter': dict(edge.by_parameter),
        'findings': list(edge.findings),
        **_place_of(picture, edge.path),
    }


def describe_finding(finding: Diagnostic) -> dict[str, Any]:
    """Return a finding as plain data."""
    span = finding.span
    return {
        'rule': finding.rule,
        'severity': finding.severity.value,
        'message': finding.message,
        'help': finding.help,
        'file': relative_path(finding.file),
        'line': span.line if span else None,
        'column': span.column if span else None,
    }


def _place_of(picture: Picture, path: DataPath) -> dict[str, Any]:
    return _place(picture.positions.key(path))


def _place(span: Span) -> dict[str, Any]:
    # A value of --set is in no file.
    is_file = span.source.home is None
    name = relative_path(span.source.name) if is_file else span.source.name
    return {'file': name, 'line': span.line}
