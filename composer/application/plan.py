"""Plans: what an edit would do to a running system, or what turns one file into another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from composer import confidential
from composer.application.file_selection import load_given
from composer.application.host_part import find_part, take_part
from composer.application.running_systems.answer_forms import SNAPSHOT, read_answer
from composer.checks.checker import check_in_context, create_context
from composer.diagnostics import has_errors
from composer.errors import ComposerError, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.values.start_reader import StartValueReader
from composer.network.variables import ros_variables
from composer.planning.differences import compare
from composer.planning.snapshot_data import conceal_both, decode_snapshot
from composer.planning.snapshot_taking import take_snapshot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import SystemSpec
    from composer.planning.plan import Plan

_SNAPSHOT_SEC = 30.0


def plan(
    paths: Sequence[Path],
    words: Sequence[str] = (),
    set_values: Sequence[str] = (),
    *,
    layers: Sequence[Path] = (),
    host: str = '',
) -> tuple[Plan | None, list[Diagnostic]]:
    """Return what turns one system into another, and what is wrong with them.

    Args:
        paths: The file of the old system, and that of the new one; one file is that of the new
            one, and the old one is the running system of its name. It is read with the layers,
            arguments and settings of that system where there are none here.
        words: Values for the arguments that both files declare.
        set_values: Values to change in both.
        layers: Files that change both.
        host: The host whose parts are compared; empty for the whole systems.

    Returns:
        The plan, `None` if there are errors, and the findings.

    Raises:
        UsageError: There are more files, or the arguments, the values to set or the host do not
            fit them.
        ComposerError: No such system runs.
    """
    if len(paths) > 2:  # noqa: PLR2004
        message = f'a plan compares two files, not {len(paths)}'
        raise UsageError(message, help='give layers with --layer')
    running: str | ComposerError = ''
    # Standard input cannot be read twice.
    if len(paths) == 1 and str(paths[0]) != '-':
        read_as = [paths[0], *layers]
        try:
            spec = load_given(read_as, words or None, is_shown=True).spec
        except UsageError:
            # The running system may have more words; without any, there are samples.
            spec = load_given(read_as, is_shown=True).spec
        running = _ask_running(spec, host) if spec else ''
        if isinstance(running, str) and running:
            given = read_answer(running, SNAPSHOT)['given']
            names = {each.partition(':=')[0] for each in words}
            kept = [each for each in given['words'] if each.partition(':=')[0] not in names]
            words = [*kept, *words]
            set_values = [*given['set_values'], *set_values]
            layers = layers or [each for each in map(Path, given['layers']) if each.is_file()]
    contexts: list[CheckContext | None] = []
    findings: list[Diagnostic] = []
    hidden: dict[str, str] = {}
    for path in paths:
        is_new = path is paths[-1]
        before = next(filter(None, contexts), None)
        context, found = _read([path, *layers], words, set_values, before, host, checks=is_new)
        contexts.append(context)
        # Both may have one, as of a layer.
        findings += [each for each in found if each not in findings]
        hidden |= confidential.hidden_values()
    confidential.hide_again(hidden)
    if has_errors(findings):
        return None, findings
    read = [each for each in contexts if each]
    if host:
        # Only the new one must have something there.
        read = [*(take_part(each, host) for each in read[:-1]), find_part(read[-1], host)]
    old, *more = read
    if more:
        return compare(take_snapshot(old), take_snapshot(more[0])), findings
    running = running or _ask_running(old.spec, host)
    if isinstance(running, ComposerError):
        raise running
    return _compare_running(running, old), findings


def plan_from(
    running: str, paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str]
) -> tuple[Plan | None, Sequence[Diagnostic], CheckContext | None]:
    """Return what its files would make of a running system, what is wrong, and what was read.

    Args:
        running: What the system answers about itself; see `plan` for the others.
    """
    context, findings = _read(paths, words, set_values, None, '', checks=True)
    if context is None or has_errors(findings):
        return None, findings, context
    return _compare_running(running, context), findings, context


def _compare_running(running: str, context: CheckContext) -> Plan:
    prefixes = decode_snapshot(read_answer(running)).prefixes
    new = take_snapshot(context, [Path(each) for each in prefixes])
    # What somebody has stopped stays so.
    stopped = read_answer(running, SNAPSHOT)['given']['stopped']
    return compare(*conceal_both(running, new.without(stopped)))


def _ask_running(spec: SystemSpec, host: str) -> str | ComposerError:
    """Return what the running system of a name answers, or why there is no answer."""
    from composer.application.running_systems.client import Client
    from composer.application.running_systems.discovery import Discovery
    from composer.runtime.control import protocol
    from composer.runtime.environment import environment_set

    name = replace(spec, host=host).running_name
    try:
        # The variables say on which graph it runs.
        with environment_set(ros_variables(spec)), Client() as client:
            system = Discovery(client).find(name)
            return client.ask(system, protocol.SNAPSHOT, _SNAPSHOT_SEC).text
    except ComposerError as error:
        return error


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
    reader = StartValueReader(host)
    system = load_given(paths, words, set_values, before_system, reader, is_shown=True)
    context = create_context(system, InterfaceCatalogue(), before)
    findings = check_in_context(system, context, host=host) if checks else system.diagnostics
    return context, findings
