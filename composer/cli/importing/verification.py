"""`composer import --verify`: run launch file and system with stand-ins, and compare the two."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from composer.ament import PACKAGE_INDEX, find_share, list_executables
from composer.errors import ExitCode
from composer.launch_files.texts import Computed
from composer.launch_files.verification.comparison import pair
from composer.launch_files.verification.given import read_given
from composer.terminal import escape_output

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.launch_files.results import Entry, Imported
    from composer.launch_files.verification.given import Given

# How long nothing may begin any more until all is taken to be there, and at most.
_QUIET_SEC = 2.0
_LONGEST_SEC = 90.0
_POLL_SEC = 0.1
_END_SEC = 20.0
_FOUND = re.compile(r"find\('(\w+)'\)")


def verify(launch_file: Path, given: Mapping[str, str], imported: Imported, system: Path) -> int:
    """Run both with stand-ins, and print how they differ; return the exit code.

    Args:
        given: The arguments of both.
        system: The file with the system, without components.
    """
    with tempfile.TemporaryDirectory(prefix='composer-verify-') as text:
        folder = Path(text)
        site = _Site(folder / 'prefix', imported, system.read_text(encoding='utf-8'))
        launched = _run('launch', launch_file.absolute(), given, folder, site)
        composed = _run('system', system.absolute(), {}, folder, site)
    return _report(launched, composed, imported, site.expected)


def without_components(imported: Imported) -> Imported:
    """Return a system with plain processes in place of containers: nothing loads stand-ins."""
    entries = [
        replace(
            entry,
            section='processes',
            data={key: value for key, value in entry.data.items() if key != 'components'},
        )
        for entry in imported.entries
        if entry.action is not None or 'launch' in entry.data
    ]
    return replace(imported, entries=entries)


class _Site:
    """Where programs are found that are not installed, and what both runs need to know.

    Args:
        prefix: A prefix of its own, to be filled.
        text: The system.
    """

    def __init__(self, prefix: Path, imported: Imported, text: str) -> None:
        entries = [entry for entry in imported.entries if entry.holds]
        self._prefix = prefix
        self.replaced: dict[str, str] = {}
        self.ends = ','.join(_names_that_end(imported))
        self.expected = sum(each.action is not None for each in entries)
        self.delay_sec = max((_now(each.data.get('delay', 0.0)) for each in entries), default=0.0)
        bin_folder = prefix / 'bin'
        bin_folder.mkdir(parents=True)
        for entry in entries:
            if 'package' in entry.data:
                self._add(str(_now(entry.data['package'])), str(_now(entry.data['executable'])))
            for word in entry.data.get('command', ())[:1]:
                program = str(_now(word))
                if '/' not in program and shutil.which(program) is None:
                    _make_program(bin_folder / program)
        for package in sorted(set(_FOUND.findall(text))):
            if find_share(package) is None:
                self._add_package(package)
        prefixes = [str(prefix), os.environ.get('AMENT_PREFIX_PATH', '')]
        self.environment = {
            **os.environ,
            'AMENT_PREFIX_PATH': os.pathsep.join(filter(None, prefixes)),
            'PATH': f'{os.environ.get("PATH", os.defpath)}{os.pathsep}{bin_folder}',
            # Nobody else is to meet the two.
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        }

    def _add(self, package: str, executable: str) -> None:
        """Make a program of a package, if the package has none of this name."""
        if executable in (path.name for path in list_executables(package)):
            return
        self._add_package(package)
        folder = self._prefix / 'lib' / package
        if not folder.exists():
            folder.mkdir(parents=True)
            for path in list_executables(package):
                (folder / path.name).symlink_to(path)
        _make_program(folder / executable)

    def _add_package(self, package: str) -> None:
        """List a package in the prefix; its files are those that are installed, if any are."""
        share = find_share(package)
        (self._prefix / PACKAGE_INDEX).mkdir(parents=True, exist_ok=True)
        (self._prefix / PACKAGE_INDEX / package).touch()
        own = self._prefix / 'share' / package
        if not own.exists():
            if share is None:
                own.mkdir()
            else:
                own.symlink_to(share)
                self.replaced[str(own)] = str(share)


def _make_program(path: Path) -> None:
    path.write_text('#!/bin/sh\n', encoding='utf-8')
    path.chmod(0o755)


def _names_that_end(imported: Imported) -> Iterator[str]:
    """Yield the names of programs whose end something waits for."""
    awaited = [wait.action for entry in imported.entries for wait in entry.waits]
    for entry in imported.entries:
        if entry.action is not None and any(entry.action is each for each in awaited):
            program = _now(entry.data.get('executable') or entry.data['command'][0])
            yield Path(str(program)).name


def _now(value: Any) -> Any:
    return value.value if isinstance(value, Computed) else value


def _run(
    kind: str, path: Path, given: Mapping[str, str], folder: Path, site: _Site
) -> list[Given]:
    """Return what the stand-ins of a run were given."""
    written = folder / kind
    written.mkdir()
    words = [f'{name}:={value}' for name, value in given.items()]
    module = 'composer.cli.importing.stand_in_runs'
    with (folder / f'{kind}.log').open('w+', encoding='utf-8') as log:
        process = subprocess.Popen(  # noqa: S603 - Composer itself
            [sys.executable, '-m', module, kind, str(written), site.ends, str(path), *words],
            env=site.environment,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        _wait(process, written, site)
        # `launch` leaves its processes behind at SIGTERM.
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_SEC)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        found = sorted(written.glob('*.json'), key=lambda each: int(each.stem))
        if len(found) < site.expected:
            log.seek(0)
            click.echo(f'{kind}: {len(found)} of {site.expected} processes began', err=True)
            click.echo(escape_output(log.read()[-2000:]), err=True)
    texts = (each.read_text(encoding='utf-8') for each in found)
    return [read_given(json.loads(text), site.replaced) for text in texts]


def _wait(process: subprocess.Popen[bytes], written: Path, site: _Site) -> None:
    """Wait until all that is expected has begun, and nothing more does."""
    count, last = 0, time.monotonic()
    until = last + _LONGEST_SEC + site.delay_sec
    while process.poll() is None and time.monotonic() < until:
        now = len(list(written.glob('*.json')))
        if now != count:
            count, last = now, time.monotonic()
        quiet_sec = time.monotonic() - last
        if count >= site.expected and quiet_sec > _QUIET_SEC:
            return
        if count and quiet_sec > _QUIET_SEC * 3 + site.delay_sec:
            return
        time.sleep(_POLL_SEC)


def _report(
    launched: list[Given], composed: list[Given], imported: Imported, expected: int
) -> int:
    """Print the differences; return the exit code."""
    pairs = pair(launched, composed)
    for each in pairs:
        click.echo(f'{each.label}: {"the same" if each.is_same else "differs"}')
        for line in () if each.is_same else each.difference():
            click.echo(f'  {line}')
    counts = Counter(each.is_same for each in pairs)
    click.echo(f'{counts[True]} of {max(len(pairs), expected)} are given the same', err=True)
    for entry in imported.entries:
        _say_what_is_left_out(entry)
    is_whole = min(len(launched), len(composed)) >= expected
    return ExitCode.DONE if is_whole and not counts[False] else ExitCode.FAILED


def _say_what_is_left_out(entry: Entry) -> None:
    if 'components' in entry.data:
        number = len(entry.data['components'])
        click.echo(f'{entry.name}: its {number} components were not compared', err=True)
    if 'launch' in entry.data:
        click.echo(f'{entry.name}: what it launches was not compared', err=True)
