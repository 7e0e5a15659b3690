"""A real terminal, with what types keys and reads the screen."""

import os
import subprocess

import pytest

from tests.running import wait_for

# readline sets `LINES` and `COLUMNS` as pytest loads it, and its processes of tests inherit them;
# curses believes them, whatever the terminal says.
_VARIABLES = {name: of for name, of in os.environ.items() if name not in {'LINES', 'COLUMNS'}}


class Terminal:
    """Runs a command in a terminal of 12 lines.

    Args:
        path: Of a socket.
    """

    def __init__(self, path):
        self._path = path

    def run(self, command, columns=100):
        """Run a command of the shell, whose exit code is shown."""
        shell = f'{command}; echo exit code $?; read'
        self._tell('new-session', '-d', '-x', f'{columns}', '-y', '12', shell)

    def type(self, *keys):
        self._tell('send-keys', *keys)

    def resize(self, columns, lines):
        self._tell('resize-window', '-x', f'{columns}', '-y', f'{lines}')

    def wait_until(self, is_shown, what):
        """Return the lines of the screen for which `is_shown` is true."""
        lines = []

        def is_there():
            lines[:] = self._tell('capture-pane', '-p').splitlines()
            return is_shown(lines)

        try:
            wait_for(is_there, what)
        except pytest.fail.Exception as error:
            pytest.fail('\n'.join([f'{error.msg}; the screen is', *lines]))
        return lines

    def shows(self, *parts):
        """Return the lines of the screen when it has all these parts."""
        return self.wait_until(
            lambda lines: all(part in '\n'.join(lines) for part in parts), f'{parts} on the screen'
        )

    def end(self):
        self._tell('kill-server', check=False)

    def _tell(self, *words, check=True):
        command = ['tmux', '-S', str(self._path), '-f', '/dev/null', *words]
        done = subprocess.run(command, env=_VARIABLES, capture_output=True, text=True, check=check)
        return done.stdout
