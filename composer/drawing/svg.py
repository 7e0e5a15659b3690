"""A picture as SVG, laid out by Graphviz."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

from composer.drawing import dot
from composer.drawing.graphviz import lay_out
from composer.drawing.qos_labels import describe_policies
from composer.drawing.shapes import tokens_of
from composer.names import join_names
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from composer.drawing.picture import Picture

_COMMENT = re.compile(r'<!--.*?-->\n?', re.DOTALL)
_TITLE = re.compile(r'(<g id="([^"]*)"[^>]*>\n)<title>[^<]*</title>\n')


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
    tokens = tokens_of(picture)
    names: dict[str, str] = {}
    for node in picture.nodes:
        full = join_names(node.namespace, node.name) if node.kind == 'node' else node.name
        names[node.id] = f'{node.kind} {full}'
    for channel in picture.channels:
        names[channel.id] = f'{channel.kind} {channel.name}: {", ".join(channel.types)}'
    for edge in picture.edges:
        policies = f', {describe_policies(edge.qos)}' if edge.qos else ''
        names[edge.id] = f'{edge.role} {edge.name} of {names[edge.node]}: {edge.type}{policies}'
    for part in picture.parts:
        said = [picture.findings[index].message for index in part.findings]
        yield tokens[part.id], '\n'.join(map(escape, [names[part.id], *said]))
