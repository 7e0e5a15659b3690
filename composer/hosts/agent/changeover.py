"""A change of what runs on this host, which can be taken back until it is committed."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.hosts.agent.files_there import (
    digest_file,
    read_json,
    read_link,
    remove_empty,
    write_file,
    write_json,
    write_link,
)
from composer.hosts.agent.host_errors import HostError, run

if TYPE_CHECKING:
    from pathlib import Path

    from composer.hosts.agent.host_unit import Service
    from composer.hosts.agent.store import Store

# Where `pending` leads at a first deployment.
NOTHING = 'none'
_BEFORE = 'before.json'
_POLL_SEC = 0.05
_OLD_START_SEC = 60.0
# As long as systems that have the same name, say, take to find each other.
_SETTLE_SEC = 1.0


class Transaction:
    """What a deployment changes here.

    While it is under way, the link `pending` leads to the release before. The unit heeds it: if it
    starts without being held, as after a loss of power, it goes back to that.

    Args:
        store: The files of the system.
        service: Its unit.
    """

    def __init__(self, store: Store, service: Service) -> None:
        self._store = store
        self._service = service
        self._release = ''
        self._reloads = False

    def stage(self, manifest: dict[str, Any]) -> str:
        """Write a new release, and return its link; see `Store.stage`."""
        self._release = self._store.stage(manifest)
        return self._release

    @property
    def hold(self) -> Path:
        """While this file is there, the system waits before it starts its behaviours."""
        return self._service.runtime / 'composer' / f'{self._service.name}.hold'

    @property
    def is_pending(self) -> bool:
        """Whether a deployment has neither been committed nor taken back."""
        return read_link(self._store.pending) is not None

    def begin(self) -> None:
        """Note how everything is now.

        Raises:
            HostError: The system must end with the login of its user.
        """
        self._service.linger()
        before = {
            'release': read_link(self._store.current),
            'unit': self._service.read(),
            'is_active': self._service.is_active(),
            'is_enabled': self._service.is_enabled(),
        }
        write_json(self._store.root / _BEFORE, before)
        write_link(self._store.pending, read_link(self._store.current) or NOTHING)
        self._service.note_restarts()

    def switch(self, release: str, unit: str, start: str) -> None:
        """Let a release start in place of the one that runs; it is held.

        Args:
            release: Its link.
            unit: The text of the unit.
            start: What the unit runs.
        """
        self._release = release
        if self._service.is_active():
            self._service.stop()
        self._write_unit(unit)
        write_file(self._store.root / 'start', start.encode(), 0o755)
        self._store.choose(release)
        write_file(self.hold, b'')
        self._service.begin()

    def wait_until_held(self, timeout_sec: float) -> None:
        """Wait until all nodes have been created.

        Raises:
            HostError: The system has ended, or they have not been created in time.
        """
        deadline = time.monotonic() + timeout_sec
        while self.hold.exists() and not self.hold.stat().st_size:
            self._service.check_start(self._service.state())
            if time.monotonic() > deadline:
                message = f'its nodes are not created within {timeout_sec:g} s'
                raise HostError(message, self._service.last_log())
            time.sleep(_POLL_SEC)
        self._service.check_start(self._service.state())

    def let_go(self) -> None:
        """Let the behaviours start."""
        self.hold.unlink(missing_ok=True)

    def wait_until_up(self, timeout_sec: float) -> None:
        """Wait until all of the system is up; see `Service.wait_until_up`."""
        self._service.wait_until_up(timeout_sec)

    def confirm(self) -> None:
        """Check that the system that is up stays so for a moment.

        Raises:
            HostError: It has ended.
        """
        time.sleep(_SETTLE_SEC)
        self._service.check_start(self._service.state())

    def reload(self, release: str, name: str, timeout_sec: float) -> str:
        """Let the system that runs become what a release says; return what it says."""
        self._release, self._reloads = release, True
        self._store.choose(release)
        return self._reload(name, timeout_sec)

    def _reload(self, name: str, timeout_sec: float) -> str:
        command = [str(self._store.live / 'composer'), 'reload', name]
        command += ['--timeout', f'{timeout_sec:g}']
        try:
            return run(command, timeout_sec=timeout_sec + 30.0).strip()
        except HostError as error:
            message = 'the system that runs cannot become the new one'
            raise HostError(message, error.help or str(error)) from error

    def leave(self) -> None:
        """Stop the system, which is to run here no more; `remove` commits that."""
        self._service.stop()

    def commit(self) -> None:
        """Keep what has been changed."""
        self._service.enable(is_wanted=True)
        self._store.pending.unlink(missing_ok=True)
        (self._store.root / _BEFORE).unlink(missing_ok=True)
        self._store.prune()

    def roll_back(self) -> str:
        """Make everything what it was before; return what that is."""
        before = read_json(self._store.root / _BEFORE)
        if not self.is_pending or before is None:
            self._store.pending.unlink(missing_ok=True)
            self._store.discard(self._release)
            if read_link(self._store.current) is None:
                self._store.remove()
            return 'nothing was changed'
        has_changed = read_link(self._store.current) != before['release']
        if self._service.is_active() and (self._reloads or not has_changed):
            self.hold.unlink(missing_ok=True)
            self._go_back_to(before)
            manifest = self._store.manifest() or {}
            with suppress(HostError):
                if has_changed:
                    self._reload(str(manifest.get('part')), _OLD_START_SEC)
        else:
            self._service.stop()
            self.hold.unlink(missing_ok=True)
            self._go_back_to(before)
        told = self._restart(before)
        self._store.discard(self._release)
        self._store.pending.unlink(missing_ok=True)
        (self._store.root / _BEFORE).unlink(missing_ok=True)
        if before['release'] is None:
            self._store.remove()
        return told

    def _go_back_to(self, before: dict[str, Any]) -> None:
        self._store.choose(before['release'])
        self._write_unit(before['unit'])

    def _restart(self, before: dict[str, Any]) -> str:
        if before['release'] is None:
            return 'all of it was removed again'
        self._service.enable(is_wanted=before['is_enabled'])
        if before['is_active'] and not self._service.is_active():
            self._service.begin()
            try:
                self._service.wait_until_up(_OLD_START_SEC)
            except HostError as error:
                return f'the release before was restored, but: {error}'
        return 'the release before was restored'

    def _write_unit(self, text: str | None) -> None:
        if text == self._service.read():
            return
        if text is None:
            self._service.enable(is_wanted=False)
            self._service.path.unlink(missing_ok=True)
        else:
            write_file(self._service.path, text.encode())
        self._service.reread()

    def remove(self) -> list[str]:
        """Stop the system and remove what was written for it; return what is left."""
        manifest = self._store.manifest() or {}
        left = []
        if self._service.read() is not None:
            self._service.stop()
            self._service.enable(is_wanted=False)
            if digest_file(self._service.path) == manifest.get('unit_digest'):
                self._service.path.unlink()
            else:
                left.append(str(self._service.path))
            self._service.reread()
        self.hold.unlink(missing_ok=True)
        for name in self._store.list_edited():
            kept = self._store.folder / 'edited' / self._store.system / name
            write_file(kept, (self._store.live / name).read_bytes())
            left.append(str(kept))
        left += map(str, self._store.keep_others())
        self._store.remove()
        remove_empty(self.hold.parent)
        return left
