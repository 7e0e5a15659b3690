"""Units of systemd, for the services that run a system on this or another host.

Sources: systemd.service(5), systemd.exec(5), systemd.syntax(7) and systemd.unit(5), which say what
must be escaped: https://www.freedesktop.org/software/systemd/man/latest/systemd.service.html
"""

from __future__ import annotations

import os
import pwd
import re
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.programs import own_command

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.export.parts import Export, HostPart, Scope

# What needs no quotes: nothing that systemd splits, expands or reads as a prefix.
_PLAIN = re.compile(r'[\w/.,:=@+-]+', re.ASCII)
_SPECIAL = re.compile(r'[\x00-\x1f\x7f"\\%]')
_NO_FILE_NAME = re.compile(r'[^A-Za-z0-9_.-]')
# systemd refuses programs with other characters in their paths, escaped or not.
_PROGRAM = re.compile(r'/[^\x00-\x1f\x7f"\'\\]+')
_NO_UNIT_NAME = re.compile(r'[^A-Za-z0-9:_.-]|^\.')
# No limit of restarts: a robot whose sensor is plugged in late comes up all the same.
_RESTART_DELAY_SEC = 5
_WRONG_USAGE = 2


def render_files(export: Export) -> dict[str, str]:
    """Return the texts of the units, by their names.

    Raises:
        ComposerError: A path cannot stand in a unit.
    """
    return {unit_name(each.system, each.host): _render(export, each) for each in export.parts}


def _render(export: Export, part: HostPart) -> str:
    must_be_there = any(export.read.values())
    file = environment_file_of(part.system)
    return render_unit(
        [*own_command(), *export.arguments(part)],
        description=f'{export.description} ({part.name})',
        folder=str(export.folder),
        stop_sec=part.stop_sec,
        scope=part.scope,
        environment=part.variables,
        environment_file=f'{"" if must_be_there else "-"}{file}' if export.read else '',
        user=part.user or pwd.getpwuid(os.getuid()).pw_name,
        reload=[*own_command(), 'reload', part.name],
        lowest_nice=part.lowest_nice,
        comments=[*_explain(export, part)],
    )


def environment_file_of(system: str) -> str:
    """Return the file with variables that the unit of a system reads."""
    return f'%E/composer/{_NO_FILE_NAME.sub("_", system)}.env'


def _explain(export: Export, part: HostPart) -> Iterator[str]:
    name = unit_name(part.system, part.host)
    is_user = part.scope == 'user'
    folder = '~/.config/systemd/user' if is_user else '/etc/systemd/system'
    manager = 'systemctl --user' if is_user else 'systemctl'
    yield f"Put it into {folder}, then: {manager} daemon-reload; {manager} enable --now '{name}'"
    if is_user:
        yield 'It starts at the boot, not at the login, after: loginctl enable-linger'
    if part.host:
        yield f'For {part.host}, where the files and Composer lie in the folders of this computer.'
    if export.read:
        yield explain_environment_file(part.scope, export.read)


def explain_environment_file(scope: Scope, names: Iterable[str]) -> str:
    """Return a comment of a unit that says where variables are given, by their names."""
    folder = '~/.config/composer' if scope == 'user' else '/etc/composer'
    listed = ', '.join(names)
    return f'EnvironmentFile: in {folder}, with a line NAME="value" for each of: {listed}'


def unit_name(system: str, host: str = '') -> str:
    """Return the name of the unit of a system, or of the part of one host.

    Characters that names of units cannot have are escaped as `systemd-escape` does it.
    """
    part = f'@{_escape_name(host)}' if host else ''
    return f'composer-{_escape_name(system)}{part}.service'


def render_unit(  # noqa: PLR0913 - a line of the unit each
    command: Sequence[str],
    *,
    description: str,
    folder: str,
    stop_sec: float,
    scope: Scope,
    environment: Mapping[str, str] | None = None,
    environment_file: str = '',
    user: str = '',
    reload: Sequence[str] = (),
    lowest_nice: int = 0,
    comments: Sequence[str] = (),
) -> str:
    """Return the text of a unit.

    Args:
        command: The program, an absolute path, and its arguments: no shell reads them, but `~/` is
            the home of the user.
        description: One line; what else it has is left out.
        folder: The working directory, an absolute path, or from `~/`.
        stop_sec: After this long in its stop the service is killed.
        scope: Whose manager runs it: that of a user, or that of the system.
        environment: Variables to set, by name; nothing confidential, as anybody may read them.
        environment_file: A file with more of them, `NAME=value` each; it must be there when the
            service starts. It can have specifiers, as `%E`; empty for none.
        user: Who runs it, if it is one of the system; empty for root.
        reload: The command of `systemctl reload`; empty for none.
        lowest_nice: The nice value that processes of it may take.
        comments: Lines to begin with, without `#`.

    Raises:
        ComposerError: The folder, or the program, has a line break or another control character.
    """
    is_system = scope == 'system'
    # The manager of a user knows no targets of the system.
    network = ['Wants=network-online.target', 'After=network-online.target'] * is_system
    variables = sorted((environment or {}).items())
    lines = [
        *(f'# {_one_line(each)}'.rstrip() for each in comments),
        '[Unit]',
        f'Description={_one_line(description).replace("%", "%%")}',
        *network,
        '# Restarts never come to an end: what is missing may come back.',
        'StartLimitIntervalSec=0',
        '',
        '[Service]',
        '# Composer tells when all of it is up; how long that may take, the system itself says.',
        'Type=notify',
        'TimeoutStartSec=infinity',
        # Without it there is no HOME, where ROS has its logs.
        *([f'User={user or "root"}'] if is_system else []),
        f'WorkingDirectory={_path(folder)}',
        *(f'Environment={quote(f"{name}={value}")}' for name, value in variables),
        *([f'EnvironmentFile={environment_file}'] if environment_file else []),
        f'ExecStart={_command(command)}',
        *([f'ExecReload={_command(reload)}'] if reload else []),
        '# Composer itself stops its workers and processes; what it leaves is killed.',
        'KillMode=mixed',
        f'TimeoutStopSec={stop_sec:g}',
        'Restart=on-failure',
        f'RestartSec={_RESTART_DELAY_SEC}',
        '# A wrong command line stays wrong.',
        f'RestartPreventExitStatus={_WRONG_USAGE}',
        *([f'LimitNICE={lowest_nice}'] if lowest_nice < 0 else []),
        '',
        '[Install]',
        f'WantedBy={"multi-user" if is_system else "default"}.target',
    ]
    return '\n'.join([*lines, ''])


def quote(word: str) -> str:
    """Return a word as units have it in `ExecStart=:` and `Environment=`, where `$` is itself."""
    return word if _PLAIN.fullmatch(word) else f'"{_SPECIAL.sub(_escaped, word)}"'


def _command(words: Sequence[str]) -> str:
    if not _PROGRAM.fullmatch(words[0]):
        message = f'systemd cannot run {words[0]!r}: no absolute path, or one with quotes'
        raise ComposerError(message)
    # With the colon, systemd replaces no `$NAME`: that it cannot be escaped in the program's path.
    return f':{" ".join(map(_word, words))}'


def _word(word: str) -> str:
    # No shell is there to find the home of the user.
    return f'%h{quote(word[1:])}' if word.startswith('~/') else quote(word)


def _escaped(found: re.Match[str]) -> str:
    character = found[0]
    if character == '%':
        return '%%'
    return f'\\{character}' if character in '"\\' else f'\\x{ord(character):02x}'


def _path(path: str) -> str:
    """Return a path as it stands alone in a line, where nothing but specifiers is replaced."""
    if path.startswith('~/'):
        return f'%h{_path(path[1:])}'
    if not path.startswith('/') or any(ord(each) < ord(' ') for each in path):
        message = f'systemd cannot be given {path!r}: it is no absolute path without line breaks'
        raise ComposerError(message)
    # The end of a line loses its spaces, and a backslash there joins it to the next one.
    end = '/' if path.endswith((' ', '\\')) else ''
    return path.replace('%', '%%') + end


def _one_line(text: str) -> str:
    line = ' '.join(text.split())
    return f'{line} .' if line.endswith('\\') else line


def _escape_name(name: str) -> str:
    return _NO_UNIT_NAME.sub(
        lambda found: ''.join(f'\\x{each:02x}' for each in found[0].encode()), name
    )
