"""Drawings of a system: its nodes, and the topics, services and actions between them.

Each format is a module with a `render_picture`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.drawing.picture import Picture

# A run imports the module of its own format only.
FORMATS: dict[str, str] = {
    'mermaid': 'composer.drawing.mermaid',
    'dot': 'composer.drawing.dot',
    'json': 'composer.drawing.json_document',
    'svg': 'composer.drawing.svg',
}
_FORMAT_OF_SUFFIX = {
    '': 'mermaid',
    '.txt': 'mermaid',
    '.mmd': 'mermaid',
    '.mermaid': 'mermaid',
    '.dot': 'dot',
    '.gv': 'dot',
    '.json': 'json',
    '.svg': 'svg',
}
DEFAULT_FORMAT = 'mermaid'


def render_picture(picture: Picture, format_name: str) -> str:
    """Return a picture in one of the formats, with a newline at its end.

    Raises:
        DrawingError: The format needs Graphviz, which is missing or failed.
    """
    text: str = importlib.import_module(FORMATS[format_name]).render_picture(picture)
    return text


def format_of(suffix: str) -> str | None:
    """Return the format for a suffix such as `.svg`, or `None`."""
    return _FORMAT_OF_SUFFIX.get(suffix.lower())
