"""YAML for the programs of others: Compose and Kubernetes read it by the rules of YAML 1.1.

In these `yes`, `on` and `y` are no texts, nor are numbers that YAML 1.2 does not know. So every
text that may be anything else stands in quotes.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:
    from collections.abc import Mapping

_WORD = re.compile(r'[A-Za-z_./][\w./-]+', re.ASCII)
_KEY = re.compile(r'( *)(?:- )?([\w.]+):( |$)')


class _Writer(yaml.SafeDumper):
    """Writes texts in quotes where they need them, and those of several lines as blocks."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: ARG002, FBT001, FBT002 - as PyYAML calls it
        # Items of a list stand deeper than its key.
        super().increase_indent(flow=flow, indentless=False)

    def generate_anchor(self, _node: yaml.Node) -> str:
        self.last_anchor_id += 1
        return f'same{self.last_anchor_id}'


def _represent_text(writer: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = None if _WORD.fullmatch(text) else '|' if '\n' in text else '"'
    return writer.represent_scalar('tag:yaml.org,2002:str', text, style)


_Writer.add_representer(str, _represent_text)


def render_document(data: Mapping[str, Any], remarks: Mapping[str, str] | None = None) -> str:
    """Return data as a YAML document, with comments above the keys that they are about.

    Args:
        remarks: The comments, by the key; each once, where that is first.
    """
    text = yaml.dump(data, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=float('inf'))
    left = dict(remarks or {})
    return ''.join(_remarked(line, left) for line in text.splitlines(keepends=True))


def literal(text: str) -> str:
    """Return a text in which Compose and Kubernetes replace no variables."""
    return text.replace('$', '$$')


def _remarked(line: str, left: dict[str, str]) -> str:
    found = _KEY.match(line)
    remark = found and left.pop(found[2], None)
    return f'{found[1]}# {remark}\n{line}' if found and remark else line
