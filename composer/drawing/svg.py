"""A picture as SVG, laid out by Graphviz: the program `dot`, or the library in pygraphviz.

Either runs in a process of its own, where it can be stopped, and a crash does no harm.
"""

from __future__ import annotations

import html
import importlib.util
import re
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

from composer.drawing import dot
from composer.errors import ComposerError
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from composer.drawing.picture import Picture

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
_COMMENT = re.compile(r'<!--.*?-->\n?', re.DOTALL)
_TITLE = re.compile(r'(<g id="([^"]*)"[^>]*>\n)<title>[^<]*</title>\n')


class DrawingError(ComposerError):
    """Graphviz is missing or failed."""


def render_picture(picture: Picture, folded: Collection[str] = (), direction: str = 'LR') -> str:
    """Return a picture as an SVG document.

    Args:
        picture: What is drawn.
        folded: See `arrange_shapes`.
        direction: See `dot.render_picture`.

    Raises:
        DrawingError: Graphviz is missing or failed.
    """
    drawn = _COMMENT.sub('', lay_out(dot.render_picture(picture, folded, direction)))
    titles = dict(_titles(picture))

    def entitle(match: re.Match[str]) -> str:
        title = titles.get(match[2])
        return f'{match[1]}<title>{html.escape(title)}</title>\n' if title else match[1]

    return _TITLE.sub(entitle, drawn).rstrip() + '\n'


def _titles(picture: Picture) -> Iterator[tuple[str, str]]:
    """Yield the token of each part, and its tooltip."""
    tokens = picture.tokens()
    titles = {box.id: box.title for box in (*picture.nodes, *picture.channels)}
    facts = {box.id: ', '.join(box.types) for box in picture.channels}
    for edge in picture.edges:
        titles[edge.id] = f'{edge.role} {edge.name} of {titles[edge.node]}'
        facts[edge.id] = ', '.join(filter(None, (edge.type, edge.policies)))
    for part in picture.parts:
        title = ': '.join(filter(None, (titles[part.id], facts.get(part.id))))
        said = [picture.findings[index].message for index in part.findings]
        yield tokens[part.id], '\n'.join(map(escape, [title, *said]))


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
