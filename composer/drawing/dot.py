"""A picture in the language of Graphviz.

Source: https://graphviz.org/doc/info/lang.html, https://graphviz.org/doc/info/shapes.html#html
"""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from composer.drawing.shapes import arrange_shapes

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from composer.drawing.picture import Picture
    from composer.drawing.shapes import Line, Region, Shape

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
_SMALL, _GREY = 9, '#57606a'
# Graphviz would look for the best layout of more nodes for minutes: 1,000 that share a topic take
# four seconds so.
_MOST_NODES = 150
_HURRIED = 'splines=line, nslimit=0.5, nslimit1=0.5, mclimit=0.05, '


def render_picture(picture: Picture, folded: Collection[str] = (), direction: str = 'LR') -> str:
    """Return a picture as a directed graph; each element has an `id` and a `class` for SVG.

    Args:
        picture: What is drawn.
        folded: See `arrange_shapes`.
        direction: Of messages, as Graphviz names it: `LR` or `TB`.
    """
    drawn = arrange_shapes(picture, folded)
    tokens = {region.id: token for token, region in drawn.regions.items()}
    separation, fonts = _RANK_SEPARATIONS[direction], f'fontname="{_FONT}", fontsize=11'
    hurry = _HURRIED if len(picture.nodes) > _MOST_NODES else ''
    lines = [
        f'digraph {_quote(picture.name)} {{',
        f'  graph [{hurry}rankdir={direction}, ranksep={separation}, nodesep=0.2, {fonts}]',
        f'  node [fontname="{_FONT}", fontsize=11, margin="0.12,0.06"]',
        f'  edge [fontname="{_FONT}", fontsize={_SMALL}, arrowsize=0.7]',
        *_region(drawn.root, 1, tokens),
        *(f'  {_line(line)}' for line in drawn.lines),
        '}',
    ]
    return '\n'.join(lines) + '\n'


def _region(region: Region, depth: int, tokens: Mapping[str, str]) -> Iterator[str]:
    indent = '  ' * depth
    for shape in region.shapes:
        yield f'{indent}{_shape(shape)}'
    for inner in region.inner.values():
        token = tokens[inner.id]
        yield f'{indent}subgraph cluster_{token[1:]} {{'
        yield (
            f'{indent}  graph [label=<{_text(inner.title)}>, id="{token}", '
            f'class="{inner.kind}", labeljust=l, {_REGIONS[inner.kind]}]'
        )
        yield from _region(inner, depth + 1, tokens)
        yield f'{indent}}}'


def _shape(shape: Shape) -> str:
    label = ''.join(
        _label((f'<B>{_text(shape.title)}</B>',), shape.details, shape.remarks, shape.mark)
    )
    look = ', '.join(filter(None, [_SHAPES[shape.kind], _MARKS.get(shape.mark)]))
    return (
        f'{shape.token} [label=<{label}>, {look}, {_hooks(shape.token, shape.kind, shape.mark)}]'
    )


def _line(line: Line) -> str:
    label = _label((), line.details, line.remarks, line.mark)
    look = ', '.join(filter(None, [_LINES[line.kind], _MARKS.get(line.mark)]))
    text = f'label=<{label}>, ' if label else ''
    return f'{line.start} -> {line.end} [{text}{look}, {_hooks(line.token, line.kind, line.mark)}]'


def _hooks(token: str, kind: str, mark: str) -> str:
    return f'id="{token}", class="{" ".join(filter(None, [kind, mark]))}"'


def _label(
    titles: tuple[str, ...], details: tuple[str, ...], remarks: tuple[str, ...], mark: str
) -> str:
    lines = [*titles]
    lines += [_font(line, _GREY) for line in details]
    lines += [_font(line, _MARK_COLOURS.get(mark, _GREY)) for line in remarks]
    return '<BR/>'.join(lines)


def _font(line: str, colour: str) -> str:
    return f'<FONT POINT-SIZE="{_SMALL}" COLOR="{colour}">{_text(line)}</FONT>'


def _text(text: str) -> str:
    # A backslash begins an escape in these labels, too.
    text = text.replace('\\', '\\\\')
    return html.escape(text)


def _quote(text: str) -> str:
    escaped = text.replace('\\', '\\\\').replace('"', '\\"').replace('\n', ' ')
    return f'"{escaped}"'
