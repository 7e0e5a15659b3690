"""`composer capture`: declarations of what runs on the ROS graph."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import click

from composer.application.output import write_file
from composer.application.running_systems.client import Client
from composer.errors import ExitCode
from composer.terminal import escape
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.runtime.middleware.graph_capture import CapturedNode
    from composer.yaml_text.positions import DataPath

_COMMAND = ['ros2', 'run', 'PACKAGE', 'EXECUTABLE']
_ABOUT_COMMAND = 'which program this is, the ROS graph does not say'


def capture(names: Sequence[str], *, output: Path | None, timeout_sec: float) -> int:
    """Write what nodes on the ROS graph have; return the exit code.

    It is 1 if a node does not answer: what it did not say is missing.

    Args:
        names: Full names of nodes, or names in any namespace; all nodes if there are none.
        output: The file to write; `None` for standard output.
        timeout_sec: How long nodes may take to answer.

    Raises:
        ComposerError: There is no such node, or the file cannot be written.
    """
    with Client() as client:
        # It needs ROS, which the client has found.
        from composer.runtime.middleware.graph_capture import capture_nodes

        nodes = capture_nodes(client.node, client.executor, names, timeout_sec)
    text = _render(nodes, client.domain_id)
    if output is None:
        click.echo(text, nl=False, color=False)
    else:
        write_file(output, text, 'the declarations')
    for node in nodes:
        if node.problem:
            click.echo(escape(f"warning: node '{node.full_name}': {node.problem}"), err=True)
    return ExitCode.FAILED if any(node.is_silent for node in nodes) else ExitCode.DONE


def _render(nodes: Sequence[CapturedNode], domain_id: int) -> str:
    """Return a file with a process for each node."""
    often = Counter(node.name for node in nodes)
    processes: dict[str, Any] = {}
    remarks: dict[DataPath, str] = {}
    for node in nodes:
        key = node.name
        if often[key] > 1 or key in processes:
            key = node.full_name.strip('/').replace('/', '_')
        processes[key] = {
            'command': _COMMAND,
            'name': node.name,
            'namespace': node.namespace,
            'nodes': {node.name: node.data},
        }
        remarks['processes', key, 'command'] = _ABOUT_COMMAND
        if node.problem:
            remarks['processes', key, 'name'] = node.problem
    title = f'# What composer capture found on the ROS graph (ROS_DOMAIN_ID {domain_id}).\n'
    document = {'version': 1, 'processes': processes}
    return title + render_yaml(document, remark=lambda path: remarks.get(path, ''))
