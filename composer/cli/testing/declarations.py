"""Declare `composer test`: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path

import click

from composer.application.test_runs.run_options import DEFAULT_PATTERN
from composer.cli.common.argument_types import takes_format, takes_words

FORMATS = ('text', 'json', 'github')

_file = click.Path(path_type=Path, dir_okay=False)


@click.command('test', epilog=f'Without PATH, the files that match {DEFAULT_PATTERN} are run.')
@takes_words('[PATH[::CASE]]...')
@click.option('-k', 'expression', metavar='EXPR', help='Run the cases whose names match.')
@click.option('-x', '--exitfirst', 'ends_early', is_flag=True, help='End at the first failure.')
@click.option(
    '--jobs',
    '-j',
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar='N',
    help='How many cases run at a time.',
)
@click.option(
    '--seed',
    type=click.IntRange(min=0),
    metavar='N',
    help='What random numbers and shuffled orders depend on, instead of what the cases say.',
)
@click.option(
    '--shuffle',
    'shuffles',
    type=click.IntRange(min=0),
    default=0,
    metavar='N',
    help='Run each case in N other legal orders, too, with one seed after the other.',
)
@click.option(
    '--real-time-limit',
    'limit_sec',
    type=click.FloatRange(min=0, min_open=True),
    metavar='SEC',
    help='End a case after so much real time, instead of what it says.',
)
@click.option('--trace', type=_file, help='Write each event to this file, a line each.')
@click.option(
    '--timeline',
    type=_file,
    help='Write when callbacks ran to this file, which Perfetto opens.',
)
@click.option('--junit', type=_file, help='Write a report in the format of JUnit to this file.')
@takes_format(FORMATS)
@click.option(
    '-s', 'shows_output', is_flag=True, help='Show at once what behaviours print and log.'
)
@click.option('--verbose', '-v', 'is_verbose', is_flag=True, help='Print more of each case.')
@click.option('--quiet', '-q', 'is_quiet', is_flag=True, help='Print failures and the summary.')
def test_command(  # noqa: PLR0913 - one for each option
    words: tuple[str, ...],
    *,
    expression: str | None,
    ends_early: bool,
    jobs: int,
    seed: int | None,
    shuffles: int,
    limit_sec: float | None,
    trace: Path | None,
    timeline: Path | None,
    junit: Path | None,
    format_name: str,
    shows_output: bool,
    is_verbose: bool,
    is_quiet: bool,
) -> int:
    """Run the cases of scenario files in virtual time.

    PATH is a file, a folder or a pattern in quotes; PATH::CASE is one case. Each case runs in a
    process of its own, without any network. The same file and seed give the same events.

    Exit codes: 0 all passed, 1 something failed, 2 wrong usage, 5 there are no cases.
    """
    from composer.application.package_files import resolve_words
    from composer.application.test_runs.run_options import RunOptions
    from composer.cli.testing.test import run_tests

    options = RunOptions(
        expression=expression,
        ends_early=ends_early,
        jobs=jobs,
        seed=seed,
        shuffles=shuffles,
        limit_sec=limit_sec,
        trace=trace,
        timeline=timeline,
        junit=junit,
        format=format_name,
        shows_output=shows_output,
        is_verbose=is_verbose,
        is_quiet=is_quiet,
    )
    return run_tests(resolve_words(words), options)
