"""Declare the commands that tell what is wrong or would change: see `composer.cli.commands`."""

from __future__ import annotations

import gc
from pathlib import Path

import click

from composer.cli.common.argument_types import (
    NUMBERS_ARE_VALUES,
    check_rule,
    check_rules,
    read_words,
    split_words,
    takes_format,
    takes_host,
    takes_settings,
    takes_system,
    takes_words,
)
from composer.reports import FORMATS

# What a check or a plan imports and reads lives until its end: to look for garbage in it as often
# as usual takes a fifth more.
_OBJECTS_BETWEEN_COLLECTIONS = 1_000_000


@click.command('check', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--matrix',
    metavar='FILE',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Check the system in each combination of arguments, layers and settings that this file '
    "names, instead of those under 'check:'.",
)
@takes_format(list(FORMATS), 'The format of the report.')
@click.option(
    '--output',
    '-o',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Write the report to this file, and print the findings as text.',
)
@click.option('--strict', is_flag=True, help='Fail on warnings, too.')
@click.option(
    '--ignore',
    'ignored',
    metavar='RULE',
    multiple=True,
    callback=check_rules,
    help='Leave out the findings of this rule. Can be repeated.',
)
@click.option(
    '--expect',
    'expected',
    metavar='RULE',
    multiple=True,
    callback=check_rules,
    help='Pass only if this rule finds something and no other rule does. Can be repeated.',
)
@click.option(
    '--import',
    'imports',
    is_flag=True,
    help='Import the behaviours and check the functions, too. Runs the code of their modules.',
)
@click.option('--quiet', '-q', is_flag=True, help='Print only errors and warnings.')
@click.option(
    '--skip-other-files',
    is_flag=True,
    help='Skip named files that are not systems, such as other YAML.',
)
@click.option(
    '--strict-packages',
    is_flag=True,
    help='Without ROS 2: report packages that are not installed as errors, too.',
)
@click.option(
    '--stdin-filename',
    metavar='PATH',
    default='<stdin>',
    help='The path to report for standard input, as editors need it.',
)
def check_command(  # noqa: PLR0913 - one for each option
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    *,
    matrix: Path | None,
    format_name: str,
    output: Path | None,
    strict: bool,
    ignored: tuple[str, ...],
    expected: tuple[str, ...],
    imports: bool,
    quiet: bool,
    skip_other_files: bool,
    strict_packages: bool,
    stdin_filename: str,
) -> int:
    """Check FILE for errors, without running anything.

    Works without ROS 2. Takes LAYER and NAME:=VALUE as `composer up` does. Without arguments and
    --set, there can be several systems: a FILE can be a folder (to check all systems in it), a
    quoted pattern, or - for standard input. Of several files, one without 'version:' is a layer
    of the one before it.
    """
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    from composer.application.check import CheckOptions
    from composer.cli.checking.check import ReportOptions, check

    options = CheckOptions(
        set_values=set_values,
        matrix=matrix,
        is_strict=strict,
        ignored=ignored,
        imports=imports,
        skip_other_files=skip_other_files,
        strict_packages=strict_packages,
        stdin_name=stdin_filename,
    )
    return check(read_words(words), options, ReportOptions(format_name, output, expected, quiet))


@click.command('plan', context_settings=NUMBERS_ARE_VALUES)
@takes_words('[OLD] NEW [NAME:=VALUE]...', required=True)
@click.option(
    '--layer',
    'layers',
    multiple=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='Change both systems by this file. Can be repeated.',
)
@takes_settings
@takes_host
@takes_format()
@click.option(
    '--exit-code',
    'tells_difference',
    is_flag=True,
    help='Exit with 2 if there is a difference.',
)
def plan_command(
    words: tuple[str, ...],
    layers: tuple[Path, ...],
    set_values: tuple[str, ...],
    host: str,
    format_name: str,
    *,
    tells_difference: bool,
) -> int:
    """Show what turns OLD, or the running system, into NEW.

    Without OLD, the system that runs is asked which has the name of NEW.
    There is a line for each operation: + added, ~ changed in place, ± recreated, - removed; with
    old and new values, why something must be recreated, and what is lost.
    """
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    from composer.cli.checking.plan import plan

    paths, arguments = split_words(words)
    if arguments[:1] == ['-']:
        paths.append(Path(arguments.pop(0)))
    return plan(
        paths,
        arguments,
        set_values,
        layers=layers,
        host=host,
        format_name=format_name,
        tells_difference=tells_difference,
    )


@click.command('explain')
@click.argument('rule', required=False, callback=check_rule)
def explain_command(rule: str | None) -> int:
    """Explain RULE with an example, or list all rules."""
    from composer.cli.checking.explain import explain

    return explain(rule)


COMMANDS = (check_command, plan_command, explain_command)
