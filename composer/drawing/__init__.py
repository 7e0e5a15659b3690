"""Drawings of a system: its nodes, and the topics, services and actions between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.drawing.picture import Picture

# With the suffixes of their files.
FORMATS = {
    'mermaid': ('', '.txt', '.mmd', '.mermaid'),
    'dot': ('.dot', '.gv'),
    'json': ('.json',),
    'svg': ('.svg',),
}


def render_picture(picture: Picture, format_name: str) -> str:
    """Return a picture in one of the formats, with a newline at its end.

    Raises:
        ComposerError: The format needs Graphviz, which is missing or failed.
    """
    from composer.drawing.graphviz import render_dot, render_svg
    from composer.drawing.json_document import render_json
    from composer.drawing.mermaid import render_mermaid
    from composer.drawing.shapes import arrange

    if format_name == 'json':
        return render_json(picture)
    renderers = {'mermaid': render_mermaid, 'dot': render_dot, 'svg': render_svg}
    return renderers[format_name](arrange(picture))
