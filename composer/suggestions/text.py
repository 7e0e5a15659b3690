"""A suggestion as text, as JSON, and as a layer file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.suggestions.suggestion import tells_others
from composer.terminal import escape
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.suggestions.suggestion import Suggestion

_MAIN = 'the process of the system'


def render_layer(suggestion: Suggestion, keys: Mapping[str, str]) -> str:
    """Return the file that makes the split, as a layer over the system's own.

    Args:
        keys: The keys of the nodes in the file, by their full names.
    """
    nodes: dict[str, Any] = {
        keys[name]: {'worker': worker} for name, worker in suggestion.moves.items()
    }
    return render_yaml({'nodes': nodes})


def render_text(suggestion: Suggestion, system: str, layer: str, target: str) -> str:
    """Return a suggestion for the terminal.

    Args:
        system: The system's name.
        layer: The layer file.
        target: How the layer is used, or where it was written.
    """
    lines = [_summary(suggestion, system), *_table(suggestion)]
    if suggestion.moves:
        lines += ['', target, '', *layer.splitlines()]
    return '\n'.join(map(escape, lines))


def _summary(suggestion: Suggestion, system: str) -> str:
    if not suggestion.moves:
        return f'{system}: no split pays: {suggestion.reason}'
    used = suggestion.after.cpu * suggestion.gain
    return (
        f'{system}: {suggestion.before.cpu:.1f} of {suggestion.load.cores} cores used → '
        f'{min(used, suggestion.load.free_cores):.1f}, expected {suggestion.gain:.1f}x'
    )


def _table(suggestion: Suggestion) -> list[str]:
    """Return what each process has, those that keep their nodes included."""
    load = suggestion.load
    split = {**load.present, **suggestion.moves}
    lines = []
    for worker in sorted(set(split.values())):
        nodes = [node for node in load.nodes if split[node.name] == worker]
        busy = [node for node in nodes if node.cpu]
        named = ', '.join(f'{node.name} {node.cpu:.0%}' for node in busy)
        unknown = [node for node in nodes if not node.is_measured]
        idle = len(nodes) - len(busy) - len(unknown)
        parts = (
            named,
            f'{idle} that did nothing' if idle else '',
            f'{len(unknown)} without figures' if unknown else '',
        )
        what = f'worker {worker}' if worker else _MAIN
        lines.append(f'  {what}: {", ".join(filter(None, parts))}')
    if tells_others(load):
        lines.append(f'  other programs use {load.others:.1f} of {load.cores} cores')
    if suggestion.after.crossing > 0:
        # What crosses already is in the figures of the nodes.
        more = ' more' if any(load.present.values()) else ''
        lines.append(f'  messages between them: {suggestion.after.crossing:.0%} of a core{more}')
    return lines


def render_json(suggestion: Suggestion, system: str, keys: Mapping[str, str]) -> str:
    """Return a suggestion as JSON."""
    load = suggestion.load
    document = {
        'version': 1,
        'name': system,
        'cores': load.cores,
        'other_programs': load.others,
        'demand': None if load.demand == float('inf') else load.demand,
        'gain': suggestion.gain,
        'reason': suggestion.reason,
        'before': _describe_cost(suggestion.before),
        'after': _describe_cost(suggestion.after),
        'nodes': [
            {
                'node': node.name,
                'cpu': node.cpu,
                'measured': node.is_measured,
                'worker': node.worker,
                'suggested': suggestion.moves.get(node.name, node.worker),
            }
            for node in load.nodes
        ],
        'layer': {
            'nodes': {keys[name]: {'worker': each} for name, each in suggestion.moves.items()}
        },
    }
    return json.dumps(document, indent=2)


def _describe_cost(cost: Any) -> dict[str, Any]:
    return {
        'busiest': cost.busiest,
        'cpu': cost.cpu,
        'crossing': cost.crossing,
        'processes': dict(cost.by_worker),
    }
