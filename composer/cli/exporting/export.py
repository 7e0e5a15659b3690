"""`composer export`: write a system for systemd, Compose or Kubernetes, or as NoDL documents."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.application.file_selection import load_given
from composer.application.output import show_findings
from composer.application.system_reader import list_files
from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.checks.placement.hosts_and_workers import find_unplaced
from composer.diagnostics import has_errors
from composer.errors import ExitCode, UsageError
from composer.export import NODL, render_files
from composer.export.nodl import render_nodl
from composer.export.parts import (
    Export,
    check_words,
    choose_read,
    describe,
    list_hosts,
    list_parts,
)
from composer.export.project import check_not_installed, find_root, list_project_files
from composer.export.written_files import mark, write_files
from composer.expressions.functions import variables_noted
from composer.interfaces.catalogue import InterfaceCatalogue

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from composer.checks.context import CheckContext
    from composer.export.parts import Scope

# What is there in any case: it runs on this computer.
_STAYS_HERE = 'systemd'


def export(  # noqa: PLR0913 - one for each option
    form: str,
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    ros_arguments: Sequence[str],
    *,
    output: Path | None,
    image: str,
    scope: Scope | None,
) -> int:
    """Print or write the files of a form; return the exit code.

    Args:
        form: One of `composer.export.FORMS`, or NoDL.
        ros_arguments: As after `--ros-args` on a command line.
        output: The folder to write to; `None` to print them.
        image: The container image to run; empty to build one.
        scope: Whose service manager runs the units; `None` for what hosts say.

    Raises:
        UsageError: The arguments or `--set` do not fit the file, the form needs an image, or the
            file is standard input.
        ComposerError: The form has no way to say something of it, or a file cannot be written.
    """
    if str(paths[0]) == '-':
        message = 'standard input cannot be exported: what is written names the file'
        raise UsageError(message, help='give a file')
    with variables_noted() as names:
        system = load_given(paths, words, set_values)
        context = create_context(system, InterfaceCatalogue())
        findings = AbsentPackages().leave_out(check_in_context(system, context))
    if context is not None and list_hosts(context.spec):
        # Nobody would run what has none.
        findings += find_unplaced(context)
    show_findings(findings)
    if context is None or has_errors(findings):
        return ExitCode.FAILED
    given = [*words, *(f'--set={each}' for each in set_values)]
    given += ['--ros-args', *ros_arguments] if ros_arguments else []
    if form == NODL:
        texts_of_files = render_nodl(context.spec)
    else:
        texts_of_files = render_files(
            _describe(form, context, paths, given, names, output=output, image=image, scope=scope)
        )
    files = {name: mark(form, text) for name, text in texts_of_files.items()}
    if output is None:
        # As `systemctl cat` separates units.
        texts = [
            f'# {name}\n{text}' if files.keys() - {name} else text for name, text in files.items()
        ]
        click.echo('\n'.join(texts), nl=False, color=False)
        return ExitCode.DONE
    for path in write_files(output, files):
        click.echo(f'wrote {path}', err=True)
    return ExitCode.DONE


def _describe(  # noqa: PLR0913 - as above
    form: str,
    context: CheckContext,
    paths: Sequence[Path],
    words: Sequence[str],
    names: Collection[str],
    *,
    output: Path | None,
    image: str,
    scope: Scope | None,
) -> Export:
    spec, read = context.spec, choose_read(names)
    check_words(words, read)
    named = [path.absolute() for path in (*paths, *list_files(context))]
    files = list_project_files(spec, named)
    stays_here, folder = form == _STAYS_HERE, Path.cwd()
    if not stays_here:
        check_not_installed(paths)
    # A program of a process that lies elsewhere is no reason to mount the folder of both.
    root = Path('/') if stays_here else find_root(set(named).intersection(files) or files)
    files = [path for path in files if path.is_relative_to(root)]
    return Export(
        form=form,
        name=spec.name,
        description=describe(spec),
        parts=tuple(list_parts(spec, stays_here=stays_here, scope=scope)),
        root=root,
        source=_source(root, output),
        folder=folder if folder.is_relative_to(root) else root,
        given=tuple(each.absolute() for each in paths),
        words=tuple(words),
        files=tuple(files),
        read=read,
        has_interfaces=bool(spec.interfaces),
        image=image,
    )


def _source(root: Path, output: Path | None) -> str:
    # Whoever has a copy of the project with these files in it can use them there.
    is_inside = output is not None and output.absolute().is_relative_to(root)
    return os.path.relpath(root, output) if output and is_inside else str(root)
