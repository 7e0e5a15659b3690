"""`composer suggest`: which nodes should run in processes of their own, and what that gains."""

from __future__ import annotations

import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING

import click

from composer.checks.checker import create_context
from composer.cli.common.file_selection import load_given
from composer.cli.common.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record
from composer.suggestions.figures import Measured, average_answers, read_recorded
from composer.suggestions.measured_load import build_load
from composer.suggestions.other_programs import cores_of_others, read_processors
from composer.suggestions.suggestion import suggest_split
from composer.suggestions.text import render_json, render_layer, render_text
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec
    from composer.suggestions.suggestion import Suggestion

_PROBE = 'composer_suggest_probe'
_POLL_SEC = 0.1


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
    measured = (
        _watch(spec.name, options.seconds)
        if options.recording is None
        else read_recorded(options.recording, spec.name)
    )
    context = create_context(system, InterfaceCatalogue())
    if context is None:
        return ExitCode.FAILED
    keys = {node.full_name: key for key, node in spec.nodes.items()}
    movable = _find_movable(load, system.spec, keys.values())
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


def _watch(name: str, seconds: float) -> Measured:
    """Return what a running system says of itself for some time."""
    from composer.cli.running import answer_forms
    from composer.cli.running.client import STATUS_SEC, Client
    from composer.cli.running.discovery import Discovery
    from composer.runtime.control import protocol

    answers = {}
    with Client() as client:
        system = Discovery(client).find(name)
        is_here = (system.status or {}).get('host') == gethostname()
        before, began, own_sec = read_processors(), time.monotonic(), time.process_time()
        with client.asking(system, protocol.TOP) as ask:
            deadline = time.monotonic() + seconds
            while True:
                outcome = ask(STATUS_SEC)
                if not outcome.succeeded:
                    raise ComposerError(outcome.text)
                answer = answer_forms.read_answer(outcome.text, answer_forms.TOP)
                if answer['has_cpu']:
                    answers[answer['period']] = answer
                if time.monotonic() >= deadline and answers:
                    break
                if time.monotonic() >= deadline + STATUS_SEC + 3 * answer['period_sec']:
                    break
                time.sleep(min(_POLL_SEC, answer['period_sec'] / 2))
        after, elapsed_sec = read_processors(), time.monotonic() - began
        own_sec = time.process_time() - own_sec
    entities = average_answers(answers.values())
    if not entities:
        message = f"system '{name}' does not say what its calls cost"
        raise ComposerError(message, help='its interpreter cannot be watched: see docs/running.md')
    processes = [each for answer in answers.values() for each in answer['processes']]
    cores = max((each['cores'] for each in processes), default=None)
    used = sum(each['cpu'] or 0.0 for each in processes) / len(answers) + own_sec / elapsed_sec
    others = cores_of_others(before, after, used, cores) if is_here and cores else 0.0
    return Measured(entities, cores, {}, others)


def _find_movable(
    load: Callable[..., LoadedSystem], spec: SystemSpec, keys: Iterable[str]
) -> set[str]:
    """Return the keys of nodes that a layer can move: not those of includes, and of loops."""
    keys = list(keys)
    found = _probe(load, spec, keys)
    # What one of them makes wrong may be all of it.
    return found or {key for key in keys if _probe(load, spec, [key])}


def _probe(load: Callable[..., LoadedSystem], spec: SystemSpec, keys: Sequence[str]) -> set[str]:
    with tempfile.NamedTemporaryFile('w', suffix='.yaml', encoding='utf-8') as file:
        file.write(render_yaml({'nodes': {key: {'worker': _PROBE} for key in keys}}))
        file.flush()
        moved = load(Path(file.name))
    if has_errors(moved.diagnostics) or moved.spec is None:
        return set()
    if moved.spec.nodes.keys() != spec.nodes.keys():
        return set()
    return {key for key in keys if moved.spec.nodes[key].worker == _PROBE}


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
