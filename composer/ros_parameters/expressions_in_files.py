"""Parameter files that a system changes before ROS reads them: expressions, and another root.

A file that is used as it is has no expressions: what looks like one would reach the nodes as text.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import yaml

from composer.diagnostics import diagnostic_at
from composer.expressions.scope import Scope
from composer.records import record
from composer.yaml_text.document import Document
from composer.yaml_text.positions import SourceMap
from composer.yaml_text.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from composer.yaml_text.writer import RCL, render_yaml

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from composer.diagnostics import Diagnostic, SourceFile, Span

_RULE = 'unevaluated-expression'
_OPEN = '{{'
# The substitutions of launch files, by their names.
_SUBSTITUTION = re.compile(
    r'\$\((?P<name>var|env|optenv|find-pkg-share|find-pkg-prefix|find-exec|exec-in-pkg|dirname|'
    r'filename|eval|command|anon|arg|find|launch_log_dir|log_dir|file-content|if|not|and|or|any|'
    r'all|equals|not-equals)(?:\s+(?P<rest>[^()]*))?\)'
)


@record
class Treatment:
    """How a parameter file is changed before it is read.

    Attributes:
        root: The namespace that its names of nodes are put in; empty for none.
        values: What its expressions have in scope; `None` if it has no expressions.
        samples: The names of those values that are samples.
    """

    root: str = ''
    values: Mapping[str, Any] | None = None
    samples: Collection[str] = ()


def treat_trees(
    trees: Sequence[TreeNode], source: SourceFile, treatment: Treatment
) -> tuple[list[TreeNode], list[Diagnostic], list[Span]]:
    """Return the documents of a file as ROS is to read them, findings, and where samples are."""
    treating = _Treating(source, treatment)
    treated = [treating.treat(tree) for tree in trees]
    if treatment.root.strip('/'):
        treated = [_with_root(tree, treatment.root) for tree in treated]
    return treated, treating.findings, treating.sampled


def render_trees(trees: Iterable[TreeNode]) -> str:
    """Return documents as YAML text that rcl reads as it would read the trees."""
    events: list[Any] = [yaml.StreamStartEvent()]
    for tree in trees:
        events += [yaml.DocumentStartEvent(explicit=True), *_events(tree)]
        events.append(yaml.DocumentEndEvent(explicit=False))
    text: str = yaml.emit([*events, yaml.StreamEndEvent()], width=float('inf'), allow_unicode=True)
    return text


def _events(node: TreeNode) -> Iterator[Any]:
    if isinstance(node, ScalarNode):
        is_untagged = node.tag is None
        implicit = (is_untagged and node.plain, is_untagged and not node.plain)
        style = '"' if not node.plain and is_untagged else None
        yield yaml.ScalarEvent(None, node.tag, implicit, node.text, style=style)
    elif isinstance(node, SequenceNode):
        yield yaml.SequenceStartEvent(None, node.tag, implicit=node.tag is None, flow_style=True)
        for item in node.items:
            yield from _events(item)
        yield yaml.SequenceEndEvent()
    else:
        yield yaml.MappingStartEvent(None, node.tag, implicit=node.tag is None, flow_style=False)
        for pair in node.pairs:
            for each in pair:
                yield from _events(each)
        yield yaml.MappingEndEvent()


def _with_root(tree: TreeNode, root: str) -> TreeNode:
    """Return a document whose names of nodes are in a namespace."""
    if not isinstance(tree, MappingNode):
        return tree
    pairs: list[tuple[TreeNode, TreeNode]] = [
        (replace(key, text=f'/{root.strip("/")}/{key.text.lstrip("/")}'), value)
        if isinstance(key, ScalarNode)
        else (key, value)
        for key, value in tree.pairs
    ]
    return MappingNode(tree.tag, tree.span, pairs)


class _Treating:
    """Walks over the documents of a file."""

    def __init__(self, source: SourceFile, treatment: Treatment) -> None:
        self.findings: list[Diagnostic] = []
        self.sampled: list[Span] = []
        self._treatment = treatment
        self._document = Document({}, SourceMap(source), self.findings, sampled=self.sampled)
        self._evaluator: Any = None
        if treatment.values is not None:
            from composer.expressions.templates import TemplateEvaluator

            values = treatment.values
            scope = Scope(values, frozenset(treatment.samples), arguments=tuple(values))
            self._evaluator = TemplateEvaluator(self._document, scope)

    def treat(self, node: TreeNode) -> TreeNode:
        if isinstance(node, ScalarNode):
            return self._treat_scalar(node)
        if isinstance(node, SequenceNode):
            return SequenceNode(node.tag, node.span, [self.treat(item) for item in node.items])
        pairs = [(self.treat(key), self.treat(value)) for key, value in node.pairs]
        return MappingNode(node.tag, node.span, pairs)

    def _treat_scalar(self, node: ScalarNode) -> TreeNode:
        if found := find_substitution(node.text):
            self._report(node, *found)
        if _OPEN not in node.text:
            return node
        if self._evaluator is None:
            end = node.text.find('}}', node.text.index(_OPEN))
            if end > 0:
                self._report(node, node.text[node.text.index(_OPEN) : end + 2], None)
            return node
        # A path of its own for each.
        path = (len(self._document.positions.values),)
        self._document.positions.values[path] = node.span
        value = self._evaluator.evaluate(node.text, path)
        return node if path in self._document.dropped else _node_of(value, node.span)

    def _report(self, node: ScalarNode, text: str, meant: str | None) -> None:
        is_used = self._treatment.values is not None
        ours = f'write {meant}' if meant else None
        how = 'let the system evaluate it: parameter_files: [{file: …, expressions: true}]'
        advice = ours if is_used else ', and '.join(filter(None, (ours, how)))
        message = f"ROS does not evaluate '{text}': it would be the value as it stands here"
        span = node.span.narrowed_to(text, first=True)
        self.findings.append(diagnostic_at(span, _RULE, message, help=advice))


def find_substitution(text: str) -> tuple[str, str] | None:
    """Return the first substitution of launch files in a text, and the expression for it."""
    found = _SUBSTITUTION.search(text) if '$(' in text else None
    return (found.group(), _in_our_words(found)) if found else None


def _in_our_words(found: re.Match[str]) -> str:
    """Return the expression for a substitution of a launch file."""
    name, words = found['name'], (found['rest'] or '').split(maxsplit=1)
    first = words[0].strip('\'"') if words else ''
    if name in ('var', 'arg') and first:
        from composer.expressions import written_in_expression

        return f'{{{{ {written_in_expression(first)} }}}}'
    if name in ('find-pkg-share', 'find') and first:
        return f"{{{{ find('{first}') }}}}"
    if name in ('env', 'optenv') and first:
        default = words[1].strip('\'"') if words[1:] else '' if name == 'optenv' else None
        more = '' if default is None else f", '{default}'"
        return f"{{{{ env('{first}'{more}) }}}}"
    return '{{ here }}' if name == 'dirname' else 'an expression in its place'


def _node_of(value: Any, span: Span) -> TreeNode:
    """Return the node that stands for the value of an expression."""
    if isinstance(value, dict):
        pairs = [(_text(key, span), _node_of(each, span)) for key, each in value.items()]
        return MappingNode(None, span, [*pairs])
    if isinstance(value, list):
        return SequenceNode(None, span, [_node_of(each, span) for each in value])
    if isinstance(value, str):
        return _text(value, span)
    text = '' if value is None else render_yaml({'': value}, RCL).partition(': ')[2].strip()
    return ScalarNode(text, None, plain=True, span=span)


def _text(text: str, span: Span) -> ScalarNode:
    return ScalarNode(text, None, plain=False, span=span, quoted=True)
