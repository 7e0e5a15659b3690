"""`composer plan`: show what an edit would do to a running system."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer import confidential
from composer.checks.checker import check_in_context, create_context
from composer.cli.common.file_selection import load_given
from composer.cli.common.host_part import find_part, take_part
from composer.cli.common.output import show_findings, wants_colour
from composer.diagnostics import has_errors
from composer.errors import ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.values.start_reader import StartValueReader
from composer.network.variables import ros_variables
from composer.planning import json_document, text
from composer.planning.differences import compare
from composer.planning.snapshot_data import conceal_snapshot, decode_snapshot
from composer.planning.snapshot_taking import take_snapshot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.planning.plan import Plan

_SNAPSHOT_SEC = 30.0


def plan(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    layers: Sequence[Path],
    host: str = '',
    format_name: str,
    tells_difference: bool,
) -> int:
    """Print what turns one system into another; return the exit code.

    Args:
        paths: The file of the old system, and that of the new one; one file is that of the new
            one, and the old one is the running system of its name.
        words: Values for the arguments that both files declare.
        set_values: Values to change in both.
        layers: Files that change both.
        host: The host whose parts are compared; empty for the whole systems.
        format_name: `text` or `json`.
        tells_difference: Whether the exit code is 2 if there is any.

    Raises:
        UsageError: There are more files, or the arguments, `--set` or the host do not fit them.
        ComposerError: No such system runs.
    """
    if len(paths) > 2:  # noqa: PLR2004
        message = f'a plan compares two files, not {len(paths)}'
        raise UsageError(message, help='give layers with --layer')
    contexts: list[CheckContext | None] = []
    findings: list[Diagnostic] = []
    hidden: dict[str, str] = {}
    for path in paths:
        is_new = path is paths[-1]
        before = next(filter(None, contexts), None)
        given = [path, *layers], words, set_values
        context, found = _read(*given, before, host, checks=is_new)
        contexts.append(context)
        # Both may have one, as of a layer.
        findings += [each for each in found if each not in findings]
        hidden |= confidential.hidden_values()
    confidential.hide_again(hidden)
    show_findings(findings)
    if has_errors(findings):
        return ExitCode.FAILED
    read = [each for each in contexts if each]
    if host:
        # Only the new one must have something there.
        read = [*(take_part(each, host) for each in read[:-1]), find_part(read[-1], host)]
    old, *more = read
    result = (
        compare(take_snapshot(old), take_snapshot(more[0])) if more else _compare_with_running(old)
    )
    if format_name == 'json':
        click.echo(json_document.render_plan(result), nl=False, color=False)
    else:
        colour = wants_colour()
        click.echo(text.render_plan(result, colour=colour), nl=False, color=colour)
    return ExitCode.USAGE if result and tells_difference else ExitCode.DONE


def _compare_with_running(context: CheckContext) -> Plan:
    from composer.cli.running.answer_forms import read_answer
    from composer.cli.running.client import Client
    from composer.cli.running.discovery import Discovery
    from composer.runtime.control import protocol
    from composer.runtime.environment import environment_set

    # They say on which graph it runs.
    with environment_set(ros_variables(context.spec)), Client() as client:
        system = Discovery(client).find(context.spec.running_name)
        answer = client.ask(system, protocol.SNAPSHOT, _SNAPSHOT_SEC)
    old = decode_snapshot(read_answer(answer.text))
    new = take_snapshot(context, [Path(each) for each in old.prefixes])
    # What was left out of the one is left out of the other.
    return compare(old, conceal_snapshot(new))


def _read(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    before: CheckContext | None,
    host: str,
    *,
    checks: bool,
) -> tuple[CheckContext | None, Sequence[Diagnostic]]:
    """Return the context of a system, and what was found in it."""
    before_system = before.system if before else None
    system = load_given(paths, words, set_values, before_system, StartValueReader(host))
    context = create_context(system, InterfaceCatalogue(), before)
    findings = check_in_context(system, context, host=host) if checks else system.diagnostics
    return context, findings
