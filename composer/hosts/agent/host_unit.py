"""The unit of systemd that runs a part of a system on this host."""

from __future__ import annotations

import os
import pwd
import shlex
import threading
import time
from pathlib import Path

from composer.hosts.agent.host_errors import HostError, last_lines, run

_POLL_SEC = 0.05
_STOP_SEC = 120.0
_MOST_LINES = '40'


class Service:
    """A unit, of the systemd of the user or of the system.

    Args:
        name: The name of the unit.
        scope: `user` or `system`.
        environment_file: The file with variables that it reads; may have `%E`.

    Attributes:
        abandoned: Set when nobody waits any more for what it does.
    """

    def __init__(self, name: str, scope: str, environment_file: str) -> None:
        self.name = name
        self._environment_file = environment_file
        self.abandoned = threading.Event()
        self._begun = 0
        self._restarts = '0'
        self.is_user = scope == 'user'
        self._words = ['--user'] if self.is_user else []
        runtime = f'/run/user/{os.getuid()}'
        if self.is_user and 'XDG_RUNTIME_DIR' not in os.environ and Path(runtime).is_dir():
            os.environ['XDG_RUNTIME_DIR'] = runtime
        self.runtime = Path(os.environ.get('XDG_RUNTIME_DIR', runtime) if self.is_user else '/run')

    @property
    def path(self) -> Path:
        """Where its file is."""
        if not self.is_user:
            return Path('/etc/systemd/system') / self.name
        return self._settings / 'systemd/user' / self.name

    @property
    def _settings(self) -> Path:
        """What systemd puts in place of `%E`."""
        own = os.environ.get('XDG_CONFIG_HOME') or Path.home() / '.config'
        return Path(own) if self.is_user else Path('/etc')

    @property
    def environment_file(self) -> Path:
        """Where variables are written that it reads."""
        return Path(self._environment_file.replace('%E', str(self._settings)))

    def variables(self) -> dict[str, str]:
        """Return the variables that it gets: of its manager, and of its file."""
        try:
            text = self.environment_file.read_text(encoding='utf-8', errors='replace')
        except FileNotFoundError:
            text = ''
        return _read_variables(self._run('show-environment')) | _read_variables(text)

    def why_unusable(self) -> str:
        """Return why this host cannot run it; empty if it can."""
        if not self.is_user and os.geteuid():
            return 'units of the system are for root, and the user is another one'
        try:
            state = self._run('show', '--property=Version')
        except HostError as error:
            return f'systemctl {" ".join(self._words)} does not answer: {error.help or error}'
        return '' if 'Version=' in state else 'systemctl does not know its version'

    def lingers(self) -> bool:
        """Return whether it runs while nobody is logged in."""
        return not self.is_user or Path('/var/lib/systemd/linger', _user()).exists()

    def linger(self) -> None:
        """Let it run while nobody is logged in, and from the boot on.

        Raises:
            HostError: This user may not.
        """
        if not self.lingers():
            try:
                run(['loginctl', 'enable-linger'])
            except HostError as error:
                message = 'units of the user would end with the login, and not start at a boot'
                raise HostError(
                    message, f"there: 'sudo loginctl enable-linger {_user()}'"
                ) from error

    def read(self) -> str | None:
        """Return the text of its file; `None` if there is none."""
        try:
            return self.path.read_text(encoding='utf-8')
        except FileNotFoundError:
            return None

    def reread(self) -> None:
        """Let systemd read its files again."""
        self._run('daemon-reload')

    def state(self) -> dict[str, str]:
        """Return what systemd says of it."""
        names = (
            'ActiveState,SubState,Job,NRestarts,UnitFileState,Result,MainPID,ExecMainExitTimestamp'
        )
        lines = self._run('show', f'--property={names}', '--', self.name).splitlines()
        return dict(line.partition('=')[::2] for line in lines)

    def is_active(self) -> bool:
        """Return whether it runs, or comes up."""
        return self.state()['ActiveState'] in ('active', 'activating', 'reloading')

    def is_enabled(self) -> bool:
        """Return whether it starts at a boot."""
        return self.state()['UnitFileState'] == 'enabled'

    def enable(self, *, is_wanted: bool) -> None:
        """Let it start at a boot, or not."""
        self._run('enable' if is_wanted else 'disable', '--quiet', '--', self.name)

    def begin(self) -> None:
        """Let it start; return before it has."""
        self._begun, self._restarts = int(time.time()), '0'
        self._run('reset-failed', '--', self.name, checks=False)
        self._run('start', '--no-block', '--', self.name)

    def note_restarts(self) -> None:
        """Note that it runs, and how often it has been started again before."""
        self._begun = int(time.time())
        self._restarts = self.state()['NRestarts'] or '0'

    def stop(self) -> None:
        """Stop it, and wait until it has stopped."""
        self._run('stop', '--', self.name, timeout_sec=_STOP_SEC)
        self._run('reset-failed', '--', self.name, checks=False)

    def wait_until_up(self, timeout_sec: float) -> None:
        """Wait until it says that it is up.

        Raises:
            HostError: It has failed, or has not come up in time.
        """
        begun = time.monotonic()
        while True:
            state = self.state()
            if state['ActiveState'] == 'active' or _has_succeeded(state):
                return
            self.check_start(state)
            if time.monotonic() > begun + timeout_sec:
                message = f'the system is not up within {timeout_sec:g} s'
                raise HostError(message, self.last_log())
            time.sleep(_POLL_SEC)

    def check_start(self, state: dict[str, str]) -> None:
        """Raise an error if a start has failed.

        Raises:
            HostError: With the end of its log.
        """
        if self.abandoned.is_set():
            message = 'who deploys is gone'
            raise HostError(message)
        if _has_succeeded(state) or _is_to_start(state):
            return
        has_restarted = state['NRestarts'] not in ('', self._restarts)
        has_ended = state['ActiveState'] in ('failed', 'inactive', 'deactivating')
        if has_restarted or has_ended or state['SubState'] == 'auto-restart':
            message = 'the system did not start'
            raise HostError(message, self.last_log())

    def last_log(self) -> str:
        """Return the end of what it has said."""
        unit = '--user-unit' if self.is_user else '--unit'
        command = ['journalctl', f'{unit}={self.name}', '-o', 'cat', '-n', _MOST_LINES, '-q']
        command.append(f'--since=@{self._begun}')
        try:
            lines = run([*command, '--no-pager']).splitlines()
        except HostError:
            return ''
        own = [line for line in lines if not line.startswith((self.name, 'Start', 'Stopp'))]
        return last_lines('\n'.join(own))

    def _run(self, *words: str, checks: bool = True, timeout_sec: float = 30.0) -> str:
        try:
            return run(['systemctl', *self._words, *words], timeout_sec=timeout_sec)
        except HostError:
            if checks:
                raise
            return ''


def _is_to_start(state: dict[str, str]) -> bool:
    """Return whether systemd has not begun yet with what it was told."""
    return state['ActiveState'] == 'inactive' and bool(state.get('Job'))


def _has_succeeded(state: dict[str, str]) -> bool:
    """Return whether a system has run and has ended by itself."""
    if _is_to_start(state):
        return False
    has_ended = state['ActiveState'] == 'inactive' and state['Result'] == 'success'
    return has_ended and state['NRestarts'] == '0' and bool(state['ExecMainExitTimestamp'])


def _user() -> str:
    return pwd.getpwuid(os.getuid()).pw_name


def _read_variables(text: str) -> dict[str, str]:
    """Return the variables of an `EnvironmentFile=`, see systemd.exec(5)."""
    found = {}
    for line in text.replace('\\\n', '').splitlines():
        name, equals, value = line.strip().partition('=')
        if equals and name.rstrip().isidentifier():
            try:
                found[name.rstrip()] = ' '.join(shlex.split(value))
            except ValueError:
                found[name.rstrip()] = value
    return found
