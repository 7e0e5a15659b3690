"""A picture as SVG, laid out by Graphviz."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

from composer.drawing import dot
from composer.drawing.layout import lay_out
from composer.drawing.plan import tokens_of
from composer.drawing.policies import describe_policies
from composer.names import join_names
from composer.reports.text import escape

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.drawing.picture import Picture

_COMMENT = re.compile(r'<!--.*?-->\n?', re.DOTALL)
_TITLE = re.compile(r'(<g id="([^"]*)"[^>]*>\n)<title>[^<]*</title>\n')


def render_picture(picture: Picture) -> str:
    """Return a picture as an SVG document.

    Raises:
        DrawingError: There is no Graphviz, or it fails.
    """
    drawn = _COMMENT.sub('', lay_out(dot.render_picture(picture)))
    titles = dict(_titles(picture))

    def entitle(match: re.Match[str]) -> str:
        title = titles.get(match[2])
        return f'{match[1]}<title>{html.escape(title)}</title>\n' if title else match[1]

    return _TITLE.sub(entitle, drawn).rstrip() + '\n'


def _titles(picture: Picture) -> Iterator[tuple[str, str]]:
    """Yield the token of each part, and what is shown where the pointer rests on it."""
    tokens = tokens_of(picture)
    names: dict[str, str] = {}
    for box in picture.boxes:
        full = join_names(box.namespace, box.name) if box.kind == 'node' else box.name
        names[box.id] = f'{box.kind} {full}'
    for hub in picture.hubs:
        names[hub.id] = f'{hub.kind} {hub.name}: {", ".join(hub.types)}'
    for edge in picture.edges:
        policies = f', {describe_policies(edge.qos)}' if edge.qos else ''
        names[edge.id] = f'{edge.role} {edge.name} of {names[edge.box]}: {edge.type}{policies}'
    for part in picture.parts:
        said = [picture.findings[index].message for index in part.findings]
        yield tokens[part.id], '\n'.join(map(escape, [names[part.id], *said]))
