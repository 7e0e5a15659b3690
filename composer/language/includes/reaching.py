"""Layers that reach into an include: what they say of a node by its full name changes that node.

It is merged where the file that declares the node has been evaluated: only then are the names
known. What meets no node is a node of its own, or a finding.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.language.layers import REACHING, Merging, is_change_of_node
from composer.language.namespaces import full_node_name, join_namespaces, split_node_name
from composer.spelling import suggest
from composer.yaml_text.positions import SourceMap

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem


def take_changes(system: LoadedSystem) -> None:
    """Take what layers say of nodes of other files out of the data of the file that is started."""
    nodes, marked = _copy_nodes(system), system.positions.values
    for key in [*nodes]:
        path = ('nodes', key)
        if (*path, REACHING) not in marked:
            continue
        if key not in system.reaching.own:
            change = nodes.pop(key)
            if path not in system.left_out:
                system.reaching.changes[key] = change, system.positions.branch(path)
        elif is_change_of_node(nodes[key]):
            del nodes[key]
            message = f"there is no node '{key}' to change"
            advice = suggest(key, system.reaching.full_names, 'there are')
            span = system.positions.key(path)
            system.diagnostics.append(diagnostic_at(span, 'changes-nothing', message, help=advice))


def apply_changes(system: LoadedSystem) -> None:
    """Let the nodes of a file be as layers change them."""
    reaching = system.reaching
    nodes = _copy_nodes(system) if reaching.changes else {}
    defaults = system.entries.get('defaults')
    inner = defaults.get('namespace', '') if isinstance(defaults, dict) else ''
    outer = join_namespaces(system.namespace, str(inner))
    for key, node in nodes.items():
        if not isinstance(node, dict):
            continue
        namespace, simple = split_node_name(key, node)
        full_name = full_node_name(join_namespaces(outer, str(namespace)), simple)
        if full_name in reaching.changes:
            data, branch = reaching.changes[full_name]
            reaching.met.add(full_name)
            positions = SourceMap(system.positions.source)
            positions.graft(('nodes', key), branch)
            merging = Merging(system.positions, positions, ())
            nodes[key] = merging.merge(node, data, ('nodes', key))
            system.diagnostics += merging.findings


def _copy_nodes(system: LoadedSystem) -> dict[str, Any]:
    """Return the nodes of a file, which may be changed now: includes of a file share its data."""
    nodes = system.entries.get('nodes')
    if not isinstance(nodes, dict):
        return {}
    copied = dict(nodes)
    system.data = system.entries | {'nodes': copied}
    return copied
