"""A picture as a mermaid flowchart, which GitHub, GitLab and many editors draw.

Source: https://mermaid.js.org/syntax/flowchart.html
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.drawing.picture import Part
    from composer.drawing.shapes import Arrangement, Region

_SHAPES = {
    'node': ('([', '])'),
    'process': ('[/', '/]'),
    'topic': ('[', ']'),
    'service': ('{{', '}}'),
    'action': ('[[', ']]'),
    'external': ('((', '))'),
}
_ARROWS = {'topic': '-->', 'service': '-->', 'action': '==>', 'external': '-.->', 'wait': '-.->'}
_CLASSES = (
    'classDef node stroke-width:2px',
    'classDef process stroke-width:2px,stroke-dasharray:6 3',
    'classDef external stroke-dasharray:3 3',
    'classDef error stroke:#d1242f,stroke-width:3px',
    'classDef warning stroke:#bf8700,stroke-width:3px',
)
_LINE_STYLES = {
    'error': 'stroke:#d1242f,stroke-width:3px,color:#d1242f',
    'warning': 'stroke:#bf8700,stroke-width:2px,color:#bf8700',
}
# What stands for itself in a quoted text; all else is written by its number.
_PLAIN = frozenset(" _/.,:()=+-'")


def render_mermaid(drawn: Arrangement) -> str:
    """Return a picture as a flowchart."""
    lines = ['flowchart LR', *_region(drawn.root, 1)]
    for line in drawn.lines:
        text = f'|"{label}"|' if (label := _label(line)) else ''
        lines.append(f'  {line.start.token} {_ARROWS[line.kind]}{text} {line.end.token}')
    marked = [(index, line.mark) for index, line in enumerate(drawn.lines) if line.mark]
    lines += [f'  linkStyle {index} {_LINE_STYLES[mark]}' for index, mark in marked]
    lines += [f'  {each}' for each in _CLASSES]
    return '\n'.join(lines) + '\n'


def _region(region: Region, depth: int) -> Iterator[str]:
    indent = '  ' * depth
    for box in region.boxes:
        opening, closing = _SHAPES[box.kind]
        style = f'{closing}:::{box.mark or box.kind}'
        yield f'{indent}{box.token}{opening}"{_label(box)}"{style}'
    for inner in region.inner:
        yield f'{indent}subgraph {inner.token}["{_escape(inner.name)}"]'
        yield from _region(inner, depth + 1)
        yield f'{indent}end'


def _label(part: Part) -> str:
    return '<br/>'.join(map(_escape, filter(None, (part.name, *part.details, *part.remarks))))


def _escape(text: str) -> str:
    return ''.join(
        each if each.isalnum() or each in _PLAIN else f'#{ord(each)};' for each in escape(text)
    )
