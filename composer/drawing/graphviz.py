"""Runs Graphviz, which lays out a drawing: the program `dot`, or the library in pygraphviz.

Either runs in a process of its own, where it can be stopped, and a crash does no harm.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys

from composer.errors import ComposerError

_LIMIT_SEC = 120.0
_WITH_LIBRARY = (
    'import sys, pygraphviz\n'
    'graph = pygraphviz.AGraph(string=sys.stdin.buffer.read().decode())\n'
    "sys.stdout.buffer.write(graph.draw(format='svg', prog='dot'))\n"
)
_MISSING_HELP = (
    "install it (pip install 'rclpy-composer[graph]', or Graphviz, the package graphviz of your "
    'system); mermaid, dot and json need none'
)


class DrawingError(ComposerError):
    """Graphviz is missing or failed."""


def lay_out(text: str) -> str:
    """Return a text in the DOT language as an SVG document.

    Raises:
        DrawingError: Graphviz is missing or failed.
    """
    try:
        done = subprocess.run(  # noqa: S603 - the program is Graphviz, the text its input
            _command(), input=text.encode(), capture_output=True, timeout=_LIMIT_SEC, check=False
        )
    except subprocess.TimeoutExpired as error:
        message = f'Graphviz found no layout in {_LIMIT_SEC:g} s'
        raise DrawingError(message, help='draw it as dot, and lay that out otherwise') from error
    except OSError as error:
        message = f'cannot run Graphviz: {error.strerror}'
        raise DrawingError(message, help=_MISSING_HELP) from error
    svg = done.stdout.decode(errors='replace')
    if done.returncode or '</svg>' not in svg:
        said = done.stderr.decode(errors='replace').strip().rpartition('\n')[2]
        message = f'Graphviz failed with code {done.returncode}: {said}'
        raise DrawingError(message)
    return svg


def _command() -> list[str]:
    program = shutil.which('dot')
    if program:
        return [program, '-Tsvg']
    if importlib.util.find_spec('pygraphviz'):
        # -P: import nothing from the working folder.
        return [sys.executable, '-P', '-c', _WITH_LIBRARY]
    message = 'svg and pages are laid out by Graphviz, which is not installed'
    raise DrawingError(message, help=_MISSING_HELP)
