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

from composer.ament import (
    COMPONENT_INDEX,
    PACKAGE_INDEX,
    find_share,
    list_components,
    list_executables,
)
from composer.errors import ExitCode
from composer.language.pipeline import load_system
from composer.launch_files.texts import Computed
from composer.launch_files.verification.comparison import pair
from composer.launch_files.verification.given import read_given
from composer.runtime.environment import find_colour
from composer.terminal import escape_output

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.launch_files.results import Imported
    from composer.launch_files.verification.given import Given

# How long nothing may begin any more until all is taken to be there, and at most.
_QUIET_SEC = 2.0
_LONGEST_SEC = 90.0
_POLL_SEC = 0.1
_END_SEC = 20.0
# Each is a run of both.
_MOST_CHANGES = 12
_MOST_CHOICES = 3
_OPPOSITES = {'true': 'false', 'false': 'true'}
_NOTHING = 'import launch\ngenerate_launch_description = launch.LaunchDescription\n'
_FOUND = re.compile(r"find\('(\w+)'\)")


def verify(launch_file: Path, words: Sequence[str], imported: Imported, system: Path) -> int:
    """Run both with stand-ins, and print how they differ; return the exit code.

    They are run with the arguments of the import, and again with other values of arguments that
    have choices or are true or false, one at a time.

    Args:
        words: The arguments of both.
        system: The file with the system.
    """
    with tempfile.TemporaryDirectory(prefix='composer-verify-') as text:
        site = _Site(Path(text) / 'prefix', imported, system.parent)
        same = _compare(launch_file, words, system, Path(text) / 'as_imported', site)
        for number, change in enumerate(other_values(imported)):
            click.echo(f'with {change}:')
            name = change.partition(':=')[0]
            others = [each for each in words if each.partition(':=')[0] != name]
            folder = Path(text) / str(number)
            same &= _compare(launch_file, [*others, change], system, folder, site)
    for entry in imported.entries:
        if 'launch' in entry.data:
            click.echo(f'{entry.name}: what it launches was not compared', err=True)
    return ExitCode.DONE if same else ExitCode.FAILED


def other_values(imported: Imported) -> list[str]:
    """Return other values of arguments, each as on a command line."""
    changes = []
    for name, argument in imported.arguments.items():
        others = [each for each in argument.choices if each != argument.given]
        if not argument.choices and argument.given.lower() in _OPPOSITES:
            other = _OPPOSITES[argument.given.lower()]
            others = [other.title() if argument.given.istitle() else other]
        changes += [] if argument.fixed else [f'{name}:={each}' for each in others[:_MOST_CHOICES]]
    return changes[:_MOST_CHANGES]


def _compare(
    launch_file: Path, words: Sequence[str], system: Path, folder: Path, site: _Site
) -> bool:
    """Run both with these arguments, and print how they differ; return whether they do not."""
    spec = load_system(system, words).spec
    started = [each for each in spec.processes.values() if not each.external] if spec else []
    expected = len(started) + len(tuple(spec.components) if spec else ())
    folder.mkdir()
    runs = [
        _Run('launch', launch_file.absolute(), words, folder, site),
        _Run('system', system.absolute(), words, folder, site),
    ]
    launched, composed = [run.finished(expected) for run in runs]
    return _report(launched, composed, expected)


def without_launch_files(imported: Imported) -> Imported:
    """Return a system without launch files that are not installed: what they start is unknown."""
    return replace(
        imported, entries=[each for each in imported.entries if 'launch' not in each.data]
    )


class _Site:
    """Where programs are found that are not installed, and what both runs need to know.

    Args:
        prefix: A prefix of its own, to be filled.
        folder: That of the system.
    """

    def __init__(self, prefix: Path, imported: Imported, folder: Path) -> None:
        entries = imported.entries
        files = [each for each in folder.rglob('*') if each.is_file()]
        text = ''.join(each.read_text(encoding='utf-8', errors='replace') for each in files)
        self._prefix = prefix
        self.replaced: dict[str, str] = {}
        self.ends = ','.join(_names_that_end(imported))
        self.delay_sec = max((_now(each.data.get('delay', 0.0)) for each in entries), default=0.0)
        bin_folder = prefix / 'bin'
        bin_folder.mkdir(parents=True)
        for entry in entries:
            for component in entry.data.get('components', {}).values():
                self._add_component(
                    str(_now(component['package'])), str(_now(component['plugin']))
                )
            if 'package' in entry.data:
                self._add(str(_now(entry.data['package'])), str(_now(entry.data['executable'])))
            if 'launch' in entry.data:
                self._add_launch_file(str(_now(entry.data['launch'])))
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
            # `composer up` tells its processes so.
            **find_colour(),
            'AMENT_PREFIX_PATH': os.pathsep.join(filter(None, prefixes)),
            'PATH': f'{os.environ.get("PATH", os.defpath)}{os.pathsep}{bin_folder}',
            # Nobody else is to meet the two.
            'ROS_DOMAIN_ID': str(1 + os.getpid() % 100),
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

    def _add_component(self, package: str, plugin: str) -> None:
        """List a class of components, if its package does not."""
        if plugin in list_components(package):
            return
        self._add_package(package)
        index = self._prefix / COMPONENT_INDEX / package
        index.parent.mkdir(parents=True, exist_ok=True)
        with index.open('a', encoding='utf-8') as file:
            file.writelines(f'{each};\n' for each in [plugin, *list_components(package)])

    def _add_launch_file(self, path: str) -> None:
        """Make an empty launch file of a package that is not installed."""
        package, _, relative = path.partition('/')
        if path.startswith(('/', '.')) or not relative or find_share(package) is not None:
            return
        self._add_package(package)
        file = self._prefix / 'share' / package / relative
        file.parent.mkdir(parents=True, exist_ok=True)
        is_python, is_xml = file.suffix == '.py', file.suffix == '.xml'
        file.write_text(_NOTHING if is_python else '<launch/>' if is_xml else 'launch: []')

    def _add_package(self, package: str) -> None:
        """List a package in the prefix; its files are those that are installed, if any are."""
        share = find_share(package)
        (self._prefix / PACKAGE_INDEX).mkdir(parents=True, exist_ok=True)
        (self._prefix / PACKAGE_INDEX / package).touch()
        own = self._prefix / 'share' / package
        if not own.exists():
            if share is None:
                own.mkdir(parents=True)
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


class _Run:
    """A launch file or a system that runs with stand-ins.

    Args:
        kind: `launch` or `system`.
        words: The arguments.
        folder: Where its stand-ins write.
    """

    def __init__(
        self, kind: str, path: Path, words: Sequence[str], folder: Path, site: _Site
    ) -> None:
        self._kind, self._site = kind, site
        self._written = folder / kind
        self._written.mkdir()
        self._log = (folder / f'{kind}.log').open('w+', encoding='utf-8')
        module = 'composer.application.importing.stand_in_runs'
        self._process = subprocess.Popen(  # noqa: S603 - Composer itself
            [sys.executable, '-m', module, kind, str(self._written), site.ends, str(path), *words],
            env=site.environment,
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def finished(self, expected: int) -> list[Given]:
        """End it when all has begun, and return what the stand-ins were given."""
        process = self._process
        self._wait(expected)
        # `launch` leaves its processes behind at SIGTERM.
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_SEC)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        found = sorted(self._written.glob('*.json'), key=lambda each: each.stat().st_mtime_ns)
        with self._log as log:
            if len(found) < expected:
                log.seek(0)
                click.echo(f'{self._kind}: {len(found)} of {expected} parts began', err=True)
                click.echo(escape_output(log.read()[-2000:]), err=True)
        texts = (each.read_text(encoding='utf-8') for each in found)
        return [read_given(json.loads(text), self._site.replaced) for text in texts]

    def _wait(self, expected: int) -> None:
        """Wait until all that is expected has begun, and nothing more does."""
        count, last = 0, time.monotonic()
        until = last + _LONGEST_SEC + self._site.delay_sec
        while self._process.poll() is None and time.monotonic() < until:
            now = len(list(self._written.glob('*.json')))
            if now != count:
                count, last = now, time.monotonic()
            quiet_sec = time.monotonic() - last
            if count >= expected and quiet_sec > _QUIET_SEC:
                return
            if count and quiet_sec > _QUIET_SEC * 3 + self._site.delay_sec:
                return
            time.sleep(_POLL_SEC)


def _report(launched: list[Given], composed: list[Given], expected: int) -> bool:
    """Print the differences; return whether there are none."""
    pairs = pair(launched, composed)
    for each in pairs:
        click.echo(f'{each.label}: {"the same" if each.is_same else "differs"}')
        for line in () if each.is_same else each.difference():
            click.echo(f'  {line}')
    counts = Counter(each.is_same for each in pairs)
    click.echo(f'{counts[True]} of {max(len(pairs), expected)} are given the same', err=True)
    return min(len(launched), len(composed)) >= expected and not counts[False]
