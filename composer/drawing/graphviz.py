"""A picture in the language of Graphviz, and as SVG, laid out by Graphviz.

That is the program `dot`, or the library in pygraphviz. Either runs in a process of its own, where
it can be stopped, and a crash does no harm.

Source: https://graphviz.org/doc/info/lang.html, https://graphviz.org/doc/info/shapes.html#html
"""

from __future__ import annotations

import html
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

from composer.drawing.picture import Box
from composer.errors import ComposerError
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.drawing.picture import Part
    from composer.drawing.shapes import Arrangement, Region

_FONT = 'Helvetica,Arial,sans-serif'
_SHAPES = {
    'node': 'shape=ellipse, style=filled, fillcolor="#ddf4ff", color="#0969da"',
    'process': 'shape=component, style=filled, fillcolor="#eaeef2", color="#57606a"',
    'topic': 'shape=box, style="rounded,filled", fillcolor="#f6f8fa", color="#8c959f"',
    'service': 'shape=hexagon, style=filled, fillcolor="#fbefff", color="#8250df"',
    'action': 'shape=octagon, style=filled, fillcolor="#dafbe1", color="#1a7f37"',
    'external': 'shape=ellipse, style=dashed, color="#8c959f", fontcolor="#57606a"',
    'folded': 'shape=box3d, margin="0.2,0.06", style=filled, fillcolor="#eaeef2", color="#57606a"',
}
_LINES = {
    'topic': 'color="#57606a"',
    'service': 'color="#8250df"',
    'action': 'color="#1a7f37"',
    'external': 'color="#8c959f", style=dashed',
    'wait': 'color="#8c959f", style=dotted',
}
_MARKS = {
    'error': 'color="#d1242f", penwidth=2.5',
    'warning': 'color="#bf8700", penwidth=2.5',
}
_MARK_COLOURS = {'error': '#d1242f', 'warning': '#9a6700'}
_REGIONS = {
    'namespace': 'style="rounded,dashed", color="#8c959f"',
    'worker': 'style=rounded, color="#0969da", penwidth=1.5',
    'host': 'style="rounded,bold", color="#57606a", penwidth=2',
}
# Texts beside arrows need room along them.
_RANK_SEPARATIONS = {'LR': 0.7, 'TB': 0.3}
# More nodes are read without zooming if there are names alone, and little room around them.
_MOST_DETAILED = 15
_ROOMY = 'ranksep={}, nodesep=0.2', 'margin="0.12,0.06"', 'margin=8'
_COMPACT = (
    'ranksep=0.2, nodesep=0.08',
    'height=0.2, width=0.2, margin="0.06,0.03"',
    'margin=4',
)
_SMALL, _GREY = 9, '#57606a'
# Graphviz would look for the best layout of more nodes for minutes: 1,000 that share a topic take
# four seconds so.
_MOST_NODES = 150
_HURRIED = 'splines=line, nslimit=0.1, nslimit1=0.1, mclimit=0.01, '
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


def render_dot(drawn: Arrangement, direction: str = 'LR') -> str:
    """Return a picture as a directed graph; each element has an `id` and a `class` for SVG.

    Args:
        direction: Of messages, as Graphviz names it: `LR` or `TB`.
    """
    picture = drawn.picture
    is_compact = len(picture.nodes) > _MOST_DETAILED
    separations, margin, inner = _COMPACT if is_compact else _ROOMY
    separations, fonts = separations.format(_RANK_SEPARATIONS[direction]), f'fontname="{_FONT}"'
    hurry = _HURRIED if len(picture.nodes) > _MOST_NODES else ''

    def draw_region(region: Region, depth: int) -> Iterator[str]:
        indent = '  ' * depth
        folded = [each.as_box() for each in region.inner if each.is_folded]
        for box in (*region.boxes, *folded):
            yield f'{indent}{box.token} {_look(box, _SHAPES, is_compact=is_compact)}'
        for each in (each for each in region.inner if not each.is_folded):
            yield f'{indent}subgraph cluster_{each.token} {{'
            yield (
                f'{indent}  graph [label=<{_text(each.name)}>, id="{each.token}", '
                f'class="{each.kind}", labeljust=l, {inner}, {_REGIONS[each.kind]}]'
            )
            yield from draw_region(each, depth + 1)
            yield f'{indent}}}'

    lines = [
        f'digraph {json.dumps(picture.name, ensure_ascii=False)} {{',
        f'  graph [{hurry}rankdir={direction}, {separations}, {fonts}, fontsize=11]',
        f'  node [{fonts}, fontsize=11, {margin}]',
        f'  edge [{fonts}, fontsize={_SMALL}, arrowsize=0.7]',
        *draw_region(drawn.root, 1),
        *(
            f'  {line.start.token} -> {line.end.token} '
            f'{_look(line, _LINES, is_compact=is_compact)}'
            for line in drawn.lines
        ),
        '}',
    ]
    return '\n'.join(lines) + '\n'


def _look(part: Part, styles: Mapping[str, str], *, is_compact: bool) -> str:
    """Return the attributes of a box or a line."""
    name = _text(part.name)
    lines = [f'<B>{name}</B>' if isinstance(part, Box) else name] if name else []
    # What stands for several says how many these are.
    details = part.details if not is_compact or part.token[0] in 'gm' else ()
    lines += [_font(line, _GREY) for line in details]
    lines += [_font(line, _MARK_COLOURS.get(part.mark, _GREY)) for line in part.remarks]
    look = styles[part.kind]
    if is_compact and part.kind == 'node':
        look = look.replace('shape=ellipse, style=filled', 'shape=box, style="rounded,filled"')
    attributes = [
        f'label=<{"<BR/>".join(lines)}>' if lines else '',
        look,
        _MARKS.get(part.mark, ''),
        f'id="{part.token}"',
        f'class="{part.kind} {part.mark}"' if part.mark else f'class="{part.kind}"',
    ]
    return f'[{", ".join(filter(None, attributes))}]'


def _font(line: str, colour: str) -> str:
    return f'<FONT POINT-SIZE="{_SMALL}" COLOR="{colour}">{_text(line)}</FONT>'


def _text(text: str) -> str:
    # A backslash begins an escape in these labels, too.
    return html.escape(escape(text).replace('\\', '\\\\'))


def render_svg(drawn: Arrangement, direction: str = 'LR') -> str:
    """Return a picture as an SVG document; see `render_dot`.

    Raises:
        ComposerError: Graphviz is missing or failed.
    """
    picture, titles = drawn.picture, {}
    for part in picture.parts:
        said = [picture.findings[index].message for index in part.findings]
        titles[part.token] = '\n'.join(map(escape, [part.title, *part.facts, *said]))

    def entitle(match: re.Match[str]) -> str:
        title = titles.get(match[2])
        return f'{match[1]}<title>{html.escape(title)}</title>\n' if title else match[1]

    document = _COMMENT.sub('', _lay_out(render_dot(drawn, direction)))
    return _TITLE.sub(entitle, document).rstrip() + '\n'


def _lay_out(text: str) -> str:
    """Return a text in the DOT language as an SVG document."""
    program = shutil.which('dot')
    if not (program or importlib.util.find_spec('pygraphviz')):
        message = 'svg and pages are laid out by Graphviz, which is not installed'
        raise ComposerError(message, help=_MISSING_HELP)
    # -P: import nothing from the working folder.
    library = [sys.executable, '-P', '-c', _WITH_LIBRARY]
    command = [program, '-Tsvg'] if program else library
    try:
        done = subprocess.run(  # noqa: S603 - the program is Graphviz, the text its input
            command, input=text.encode(), capture_output=True, timeout=_LIMIT_SEC, check=False
        )
    except subprocess.TimeoutExpired as error:
        message = f'Graphviz found no layout in {_LIMIT_SEC:g} s'
        raise ComposerError(message, help='draw it as dot, and lay that out otherwise') from error
    except OSError as error:
        message = f'cannot run Graphviz: {error.strerror}'
        raise ComposerError(message, help=_MISSING_HELP) from error
    svg = done.stdout.decode(errors='replace')
    if done.returncode or '</svg>' not in svg:
        said = done.stderr.decode(errors='replace').strip().rpartition('\n')[2]
        message = f'Graphviz failed with code {done.returncode}: {said}'
        raise ComposerError(message)
    return svg
