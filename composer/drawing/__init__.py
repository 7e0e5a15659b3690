"""A system as people draw it: nodes, and the topics, services and actions between them.

Each form is one module with a `render_picture`, listed in one table.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.drawing.picture import Picture

# A run pays for the import of its own form only.
FORMATS: dict[str, str] = {
    'mermaid': 'composer.drawing.mermaid',
    'dot': 'composer.drawing.dot',
    'json': 'composer.drawing.json_document',
    'svg': 'composer.drawing.svg',
    'html': 'composer.drawing.page',
}
_ENDINGS = {
    '': 'mermaid',
    '.txt': 'mermaid',
    '.mmd': 'mermaid',
    '.mermaid': 'mermaid',
    '.dot': 'dot',
    '.gv': 'dot',
    '.json': 'json',
    '.svg': 'svg',
    '.html': 'html',
    '.htm': 'html',
}
DEFAULT_FORMAT = 'mermaid'


def render_picture(picture: Picture, format_name: str) -> str:
    """Return a picture in one of the forms, with a newline at its end.

    Raises:
        DrawingError: The form needs Graphviz, and it is not there or fails.
    """
    text: str = importlib.import_module(FORMATS[format_name]).render_picture(picture)
    return text


def format_of(ending: str) -> str | None:
    """Return the form that files of an ending, as in `.svg`, are written in, if there is one."""
    return _ENDINGS.get(ending.lower())
