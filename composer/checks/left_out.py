"""Check that `when` leaves something to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.diagnostics import has_errors

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic


def check_left_out(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that not all nodes and processes are left out, with the arguments as they are."""
    system, spec, unused = context.system, context.spec, context.system.unused
    if spec.nodes or spec.processes or unused is None or system.given.samples:
        return
    if has_errors(system.diagnostics):
        # What was dropped may have been something to run.
        return
    paths = [
        *(node.path for node in unused.nodes.values()),
        *(process.path for process in unused.processes.values()),
    ]
    for path in paths[:1]:
        when = (*path, 'when')
        is_its_own = when in system.positions.values
        yield (context.at_value if is_its_own else context.at_key)(
            when if is_its_own else path,
            'nothing-to-run',
            "nothing of this system is left to run: each 'when' is false",
            help='give arguments that leave something',
        )
