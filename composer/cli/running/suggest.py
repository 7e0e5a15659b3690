"""`composer suggest`: which nodes should run in processes of their own, and what that gains."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from composer.application.file_selection import load_given
from composer.application.output import show_findings
from composer.checks.checker import create_context
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record
from composer.suggestions.figures import read_recorded
from composer.suggestions.measured_load import build_load
from composer.suggestions.movable_nodes import find_movable
from composer.suggestions.suggestion import suggest_split
from composer.suggestions.text import render_json, render_layer, render_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec
    from composer.suggestions.suggestion import Suggestion


@record
class SuggestOptions:
    """What is asked for.

    Attributes:
        recording: An MCAP file or a folder of rosbag2; `None` for the system that runs.
        seconds: How long to watch that.
        cores: How many processor cores there are; `None` for those of where it was measured.
        host: The host whose part is meant; empty for a system that has none.
        output: The layer file to write; `None` to print it.
        format_name: `text` or `json`.
    """

    recording: Path | None
    seconds: float
    cores: int | None
    host: str
    output: Path | None
    format_name: str


def suggest(
    paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str], options: SuggestOptions
) -> int:
    """Print a split and what it gains; return the exit code.

    Raises:
        UsageError: The arguments or `--set` do not fit the file, or the layer file exists.
        ComposerError: There are no figures, or the layer file cannot be written.
    """

    def load(*layers: Path) -> LoadedSystem:
        return load_given([*paths, *layers], words, set_values)

    if options.output is not None and options.output.is_file():
        message = f"'{options.output}' exists, and is not overwritten"
        raise UsageError(message)
    system = load()
    show_findings([each for each in system.diagnostics if has_errors([each])])
    if has_errors(system.diagnostics) or system.spec is None:
        return ExitCode.FAILED
    spec = _part_of(system.spec, options.host)
    from composer.application.running_systems.health import measure

    measured = (
        measure(spec.name, options.seconds)
        if options.recording is None
        else read_recorded(options.recording, spec.name)
    )
    context = create_context(system, InterfaceCatalogue())
    if context is None:
        return ExitCode.FAILED
    keys = {node.full_name: key for key, node in spec.nodes.items()}
    movable = find_movable(load, system.spec, keys.values())
    fixed = frozenset(name for name, key in keys.items() if key not in movable)
    if options.cores:
        # Who else uses those is not known.
        measured = replace(measured, others=0.0)
    cores = options.cores or measured.cores or os.cpu_count() or 1
    suggestion = suggest_split(build_load(context, spec, measured, cores, fixed))
    _tell(suggestion, spec.name, keys, paths, options)
    return ExitCode.DONE


def _part_of(spec: SystemSpec, host: str) -> SystemSpec:
    """Return the part of a host.

    Raises:
        ComposerError: There is no such host, or it must be said which.
    """
    hosts = sorted({node.host for node in spec.nodes.values()})
    if host:
        if host not in hosts:
            message = f"no node of '{spec.name}' is on host '{host}'"
            raise ComposerError(message, help=f'there are: {", ".join(filter(None, hosts))}')
        return spec.on_host(host)
    if len(hosts) > 1:
        message = f"'{spec.name}' has nodes on several hosts"
        named = ', '.join(filter(None, hosts))
        raise ComposerError(message, help=f'say which one with --host: {named}')
    return spec


def _tell(
    suggestion: Suggestion,
    name: str,
    keys: dict[str, str],
    paths: Sequence[Path],
    options: SuggestOptions,
) -> None:
    layer = render_layer(suggestion, keys)
    if options.output is not None and suggestion.moves:
        try:
            options.output.write_text(layer, encoding='utf-8')
        except OSError as error:
            message = f"'{options.output}' cannot be written: {error.strerror}"
            raise ComposerError(message) from error
    if options.format_name == 'json':
        click.echo(render_json(suggestion, name, keys))
        return
    files = ' '.join(map(str, paths))
    target = (
        f'the layer for it, as in composer up {files} split.yaml:'
        if options.output is None
        else f'written to {options.output}: composer up {files} {options.output}'
    )
    click.echo(render_text(suggestion, name, layer, target))
