"""A tree of nodes → plain data; merge keys and aliases are resolved, positions recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.input_limits import MAX_DEPTH, MAX_FINDINGS, MAX_VALUES
from composer.yaml_text.scalars import (
    TAG_MAP,
    TAG_SEQ,
    ScalarError,
    parse_plain_scalar,
    parse_tagged_scalar,
    short_tag,
)
from composer.yaml_text.tree import (
    CompositionError,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
)

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.yaml_text.positions import DataPath, SourceMap

_MERGE_KEY = '<<'


def construct_data(
    root: TreeNode | None, positions: SourceMap
) -> tuple[Any, tuple[Diagnostic, ...]]:
    """Return the data of a tree and the findings; fill in its positions.

    Raises:
        CompositionError: Aliases expand to more than `MAX_VALUES` values, or to 100 levels.
    """
    constructor = _Constructor(positions)
    data = None if root is None else constructor.construct(root, ())
    return data, tuple(constructor.findings)


class _Constructor:
    def __init__(self, positions: SourceMap) -> None:
        self.findings: list[Diagnostic] = []
        self._keys = positions.keys
        self._values = positions.values
        self._count = 0
        self._merging = 0

    def construct(self, node: TreeNode, path: DataPath) -> Any:
        self._count += 1
        if self._count > MAX_VALUES:
            self._stop_expanding(node, path)
        self._values[path] = node.span
        if isinstance(node, ScalarNode):
            return self._scalar(node)
        if len(path) > MAX_DEPTH:
            self._stop(node.span, 'too-deep', f'aliases nest more than {MAX_DEPTH} levels deep')
        wanted = TAG_MAP if isinstance(node, MappingNode) else TAG_SEQ
        if node.tag not in (None, wanted):
            self._report(node, 'bad-tag', f'a {short_tag(node.tag or "")} is not allowed here')
        if isinstance(node, SequenceNode):
            return [self.construct(item, (*path, index)) for index, item in enumerate(node.items)]
        return self._mapping(node, path)

    def _stop_expanding(self, node: TreeNode, path: DataPath) -> NoReturn:
        entry = self._keys.get(path[:1], node.span)
        self._stop(entry, 'alias-bomb', f'aliases expand to more than {MAX_VALUES:,} values')

    def _scalar(self, node: ScalarNode) -> Any:
        try:
            if node.tag is not None:
                return parse_tagged_scalar(node.text, node.tag)
            return parse_plain_scalar(node.text) if node.plain else node.text
        except ScalarError as error:
            self._report(node, 'bad-scalar', str(error))
            return node.text

    def _mapping(self, node: MappingNode, path: DataPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        merge: tuple[TreeNode, TreeNode] | None = None
        for key_node, value_node in node.pairs:
            key = self._key(key_node)
            if key is None:
                continue
            if key == _MERGE_KEY and isinstance(key_node, ScalarNode) and key_node.plain:
                if merge is None:
                    merge = key_node, value_node
                else:
                    self._duplicate(_MERGE_KEY, key_node, merge[0].span)
                continue
            key_path = (*path, key)
            if key in data:
                self._duplicate(key, key_node, self._keys[key_path])
                continue
            self._keys[key_path] = key_node.span
            data[key] = self.construct(value_node, key_path)
        if merge:
            self._merge(merge[1], data, path)
        return data

    def _key(self, node: TreeNode) -> str | None:
        value = self._scalar(node) if isinstance(node, ScalarNode) else None
        if isinstance(value, str):
            return value
        if not isinstance(node, ScalarNode):
            # `{{ name }}` without quotes is a mapping whose key is a mapping.
            template = isinstance(node, MappingNode)
            quoting = 'put an expression in quotes: "{{ name }}"' if template else None
            message = 'a key must be a string, not a list or a mapping'
            self._report(node, 'bad-key', message, help=quoting)
            return None
        if not node.text:
            self._report(node, 'bad-key', 'a key must be a string, and this one is empty')
            return None
        self._report(
            node,
            'bad-key',
            f'a key must be a string, and {node.text} is not',
            help=f"write '{node.text}'",
        )
        return node.text

    def _duplicate(self, key: str, node: TreeNode, span: Span) -> None:
        if len(self.findings) > MAX_FINDINGS:
            return
        first = Related('first used here', span)
        self.findings.append(
            diagnostic_at(
                node.span,
                'duplicate-key',
                f"the key '{key}' appears twice in one mapping",
                help='merge several with <<: [*one, *two]'
                if key == _MERGE_KEY
                else f'keep one; the first is on line {first.span.line}',
                related=[first],
            )
        )

    def _merge(self, node: TreeNode, data: dict[str, Any], path: DataPath) -> None:
        """Add what `node` has and `data` lacks; earlier mappings of a list win over later ones."""
        self._merging += 1
        if self._merging > MAX_DEPTH:
            self._stop(node.span, 'too-deep', f'merges nest more than {MAX_DEPTH} levels deep')
        parts = node.items if isinstance(node, SequenceNode) else [node]
        for part in parts:
            if not isinstance(part, MappingNode):
                self._report(
                    part, 'bad-merge', 'the merge key << takes a mapping, or a list of them'
                )
                continue
            # An empty mapping counts as well: merging it many times takes time too.
            self._count += max(1, len(part.pairs))
            if self._count > MAX_VALUES:
                self._stop_expanding(part, path)
            merged = MappingNode(None, part.span)
            for key_node, value_node in part.pairs:
                known = isinstance(key_node, ScalarNode) and key_node.text in data
                if not known:
                    merged.pairs.append((key_node, value_node))
            data.update(self._mapping(merged, path))
        self._merging -= 1

    def _report(self, node: TreeNode, rule: str, message: str, help: str | None = None) -> None:  # noqa: A002
        # Nobody sees more, and each takes its time.
        if len(self.findings) <= MAX_FINDINGS:
            self.findings.append(diagnostic_at(node.span, rule, message, help=help))

    def _stop(self, span: Span, rule: str, message: str) -> NoReturn:
        raise CompositionError(diagnostic_at(span, rule, message))
