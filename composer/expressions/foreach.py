"""`foreach` and `when`: repeats entries for each value of a variable, or leaves them out.

Both stand in the entries of some sections, and in the entities of nodes. What an entry is repeated
for is in scope in its key and in all below it; an entry that is left out is still held against the
schema.
"""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeAlias

from jinja2 import TemplateRuntimeError

from composer.diagnostics import Related, diagnostic_at
from composer.entity_kinds import KIND_OF_SECTION
from composer.expressions import SECTIONS, has_conditions, is_conditional, is_variable_name
from composer.expressions.functions import TRUTH
from composer.expressions.scanner import OPEN
from composer.expressions.templates import TemplateEvaluator
from composer.input_limits import MAX_ENTRIES, MAX_VALUES
from composer.yaml_text.document import count_values
from composer.yaml_text.positions import Branch
from composer.yaml_text.scalars import format_scalar, suggest_bool

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from composer.expressions.scope import Scope
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath, Key

# By the defaults of the file, the key of a node, what it says, and the name of a parameter:
# what is wrong with it, and what it starts with.
FindList: TypeAlias = 'Callable[[Mapping[str, Any], str, Mapping[str, Any], Any], tuple[str, Any]]'

_FOREACH = 'foreach'
_WHEN = 'when'
_PARAMETER = 'parameter'
# The sections whose entries have entries of their own.
_WITH_ENTRIES = (('nodes',), ('containers',))
# The value of a variable without a list of values.
_SAMPLE = 1


def expand_document(
    document: Document,
    data: dict[str, Any],
    scope: Scope,
    find_list: FindList,
) -> dict[str, Any] | None:
    """Return data with all expressions evaluated, and entries repeated or left out.

    If there are more entries than a file may have, the finding says so, and the result is `None`.

    Args:
        document: The document that the data are from; what is learnt on the way goes there.
        scope: What is in scope.
        find_list: Finds the list that a parameter of a node starts with.
    """
    evaluator = TemplateEvaluator(document, scope)
    ignored = {key: value for key, value in data.items() if key.startswith('x-')}
    plain = {key: value for key, value in data.items() if key not in (*SECTIONS, *ignored)}
    filled = evaluator.evaluate_mapping(plain, ()) | ignored
    limit, size = _limit_of(filled), _Size()
    for section in SECTIONS:
        if isinstance(data.get(section), dict):
            expansion = _Expansion(evaluator, (section,), limit, size)
            defaults = filled.get('defaults')
            expansion.find_list = partial(
                find_list, defaults if isinstance(defaults, dict) else {}
            )
            try:
                filled[section] = expansion.expand(data[section])
            except _TooManyError:
                return None
        elif section in data:
            filled[section] = evaluator.evaluate(data[section], (section,))
    return filled


def _limit_of(data: Mapping[str, Any]) -> int:
    limit = data.get('max_nodes')
    # The schema reports any other value.
    return min(limit, sys.maxsize - 1) if type(limit) is int and limit > 0 else MAX_ENTRIES


class _TooManyError(Exception):
    """There are more entries than a file may have, and that has been reported."""


class _Size:
    """How many keys and values the entries that are repeated have."""

    def __init__(self) -> None:
        self.values = 0


class _Expansion:
    """Expands the entries of one section.

    Args:
        at: The path of the section.
        limit: The most entries that it may have.
        size: What all sections of the document count in.
        branches: The positions of its entries as they were written; `None` if these are where the
            document has them now.
    """

    def __init__(
        self,
        evaluator: TemplateEvaluator,
        at: DataPath,
        limit: int,
        size: _Size,
        branches: Mapping[Key, Branch] | None = None,
    ) -> None:
        self._evaluator = evaluator
        self._document = evaluator.document
        self._at = at
        self._section = str(at[-1])
        self._limit = limit
        self._size = size
        self._entries: dict[str, Any] = {}
        self._count = 0
        self._branches = branches
        # Of nodes: returns what a parameter of one starts with; of their entities: that of theirs.
        self.find_list: Callable[..., Any] | None = None

    def expand(self, data: dict[str, Any]) -> dict[str, Any]:
        for written, entry in data.items():
            if not is_conditional(entry):
                self._count += 1
                self._add(self._evaluator, written, entry, is_left_out=False)
                continue
            path = (*self._at, written)
            body = {key: value for key, value in entry.items() if key not in (_FOREACH, _WHEN)}
            if entry.get(_FOREACH) == {}:
                self._report((*path, _FOREACH), f'{_FOREACH} has no variables')
                self._document.dropped.add(path)
                continue
            before = len(self._document.diagnostics)
            foreach = entry.get(_FOREACH)
            variables = foreach if isinstance(foreach, dict) else None
            scopes = self._list_scopes(entry.get(_FOREACH, {}), (*path, _FOREACH))
            self._size.values += len(scopes) * count_values(body)
            if self._size.values > MAX_VALUES:
                self._report_limit((*path, _FOREACH), f'{MAX_VALUES:,} keys and values')
                raise _TooManyError
            for evaluator in scopes:
                holds = self._holds(evaluator, entry.get(_WHEN, True), (*path, _WHEN))
                # With other arguments it may be there, and then its values are other ones.
                given = evaluator if holds else evaluator.of_samples()
                self._add(given, written, body, variables, is_left_out=not holds)
                before = -1
            if len(self._document.diagnostics) > before >= 0:
                # It is missing because of an error, not because there are no values.
                self._document.dropped.add(path)
        return self._entries

    def _add(
        self,
        evaluator: TemplateEvaluator,
        written: str,
        body: Any,
        variables: Collection[str] | None = None,
        *,
        is_left_out: bool,
    ) -> None:
        written_path = (*self._at, written)
        key = evaluator.evaluate_key(written_path)
        path = (*self._at, key)
        if key in self._entries:
            if path in self._document.left_out:
                self._document.left_out.discard(path)
            elif is_left_out:
                return
            else:
                self._report_duplicate(key, written_path, variables)
                return
        if key != written:
            self._graft(path, written)
        entry = self._evaluate(evaluator, body, path, written)
        self._entries[key] = _with_scope(entry, path, evaluator)
        if is_left_out:
            self._document.left_out.add(path)

    def _evaluate(
        self, evaluator: TemplateEvaluator, body: Any, path: DataPath, written: str
    ) -> Any:
        """Return an entry with its expressions evaluated, and its entities repeated."""
        repeated = _sections_with_conditions(body) if self._at in _WITH_ENTRIES else ()
        if not repeated:
            return evaluator.evaluate(body, path)
        rest = {key: value for key, value in body.items() if key not in repeated}
        filled = evaluator.evaluate_mapping(rest, path)
        written_at = self._branch(written)
        # Others may be repeated for what parameters say.
        for section in sorted(repeated, key=lambda each: each != 'parameters'):
            expansion = _Expansion(
                evaluator,
                (*path, section),
                MAX_ENTRIES,
                self._size,
                written_at.inner(section),
            )
            if self.find_list is not None and self._section == 'nodes':
                expansion.find_list = partial(self.find_list, str(path[-1]), filled)
            filled[section] = expansion.expand(body[section])
        # As written: entities are told in this order.
        return {key: filled[key] for key in body if key in filled} | filled

    def _graft(self, path: DataPath, written: str) -> None:
        self._evaluator.positions.graft(path, self._branch(written))

    def _branch(self, written: str) -> Branch:
        if self._branches is None:
            self._branches = self._evaluator.positions.branches(self._at)
        return self._branches.get(written) or Branch((), ())

    def _list_scopes(self, foreach: Any, path: DataPath) -> list[TemplateEvaluator]:
        """Return all scopes of an entry; raise if there are more than entries are allowed."""
        room = max(self._limit - self._count, 0)
        try:
            scopes = list(islice(self._scopes(foreach, path), room + 1))
        except TemplateRuntimeError as error:
            self._report(path, str(error))
            raise _TooManyError from error
        self._count += len(scopes)
        if len(scopes) > room:
            self._report_limit(path, f'{self._limit:,} entries')
            raise _TooManyError
        return scopes

    def _scopes(
        self, foreach: Any, path: DataPath, evaluator: TemplateEvaluator | None = None
    ) -> Iterator[TemplateEvaluator]:
        """Yield an evaluator for each combination of values, the last variable's fastest."""
        evaluator = evaluator or self._evaluator
        if not isinstance(foreach, dict):
            self._report(path, f"{_FOREACH} must be a mapping, as in 'foreach: {{i: [1, 2]}}'")
            return
        if not foreach:
            yield evaluator
            return
        name, *others = foreach
        at = (*path, name)
        if not is_variable_name(name):
            self._report(at, f"'{name}' cannot be used as a name in expressions")
            return
        evaluator.spend_on_values(count_values(foreach[name]))
        values = evaluator.evaluate(foreach[name], at)
        is_sample = evaluator.is_sampled(at)
        if isinstance(values, dict) and values.keys() == {_PARAMETER}:
            values = self._list_of(values[_PARAMETER], at)
        if not isinstance(values, list):
            if at not in self._document.dropped:
                self._report(at, f"'{name}' takes a list of values, not {values!r}")
            # The rest of the entry is still read once.
            values, is_sample = [_SAMPLE], True
        rest = {other: foreach[other] for other in others}
        for value in values:
            evaluator.spend_on_values(1)
            inner = evaluator.within(name, value, _FOREACH, is_sample=is_sample)
            yield from self._scopes(rest, path, inner)

    def _list_of(self, name: Any, path: DataPath) -> Any:
        """Return the list that a parameter of the node starts with, and note who follows it."""
        if self.find_list is None or len(self._at) == 1:
            problem, values = 'only entities of nodes can follow a parameter', None
        else:
            problem, values = self.find_list(name)
        if problem:
            self._report(path, f'{_FOREACH}: {problem}')
            self._document.dropped.add(path)
            return None
        positions = self._evaluator.positions
        positions.values[(*self._at[:-1], 'parameters', name, _FOREACH)] = positions.value(path)
        return values

    def _holds(self, evaluator: TemplateEvaluator, condition: Any, path: DataPath) -> bool:
        holds = evaluator.evaluate(condition, path)
        if path in self._document.dropped:
            return False
        if not isinstance(holds, bool):
            message = f'{_WHEN} must be true or false, not {holds!r}'
            self._report(path, message, _help_for_condition(condition, holds))
            return False
        return holds

    def _report(self, path: DataPath, message: str, help_text: str | None = None) -> None:
        rule = 'bad-when' if path[len(self._at) + 1] == _WHEN else 'bad-foreach'
        span = self._evaluator.positions.value(path)
        self._document.diagnostics.append(diagnostic_at(span, rule, message, help=help_text))

    def _report_duplicate(
        self, key: str, path: DataPath, variables: Collection[str] | None
    ) -> None:
        if variables is None:
            self._evaluator.report_duplicate(key, path, (*self._at, key))
            return
        self._document.diagnostics.append(
            diagnostic_at(
                self._evaluator.positions.key(path),
                'duplicate-key',
                f"foreach makes more than one '{key}'",
                help=_help_for_duplicate(str(path[-1]), variables),
            )
        )

    def _limit_place(self) -> tuple[Related, ...]:
        span = self._evaluator.positions.keys.get(('max_nodes',))
        span = span if len(self._at) == 1 else None
        return (Related('the limit is set here', span),) if span else ()

    def _report_limit(self, path: DataPath, what: str) -> None:
        self._document.diagnostics.append(
            diagnostic_at(
                self._evaluator.positions.key(path),
                'too-many-entries',
                f'{self._section} has more than {what}',
                related=self._limit_place(),
                help="raise 'max_nodes' at the top of the file if that is intended"
                if len(self._at) == 1
                else None,
            )
        )


def _help_for_condition(condition: Any, holds: Any) -> str | None:
    """Return the help for a condition that is neither true nor false."""
    meant = TRUTH.get(str(holds).strip().lower())
    written = str(condition).strip()
    if OPEN not in written:
        literal = f'"{OPEN} {written} }}}}"' if meant is None else format_scalar(meant)
        return suggest_bool(holds) or f'write {literal}'
    if written.count(OPEN) > 1 or not written.startswith(OPEN):
        return None
    begun = f'{OPEN} {written.strip("{} ")}'
    return f'compare it: {begun} == … }}}}' if meant is None else f'write {begun} | bool }}}}'


def _help_for_duplicate(written: str, variables: Collection[str]) -> str:
    missing = [name for name in variables if not re.search(rf'\b{name}\b', written)]
    if not missing:
        return "a variable's list should have each value once"
    more = ''.join(f'_{{{{ {name} }}}}' for name in missing)
    return f'use its variables in the name, as in "{written}{more}"'


def _sections_with_conditions(node: Any) -> tuple[str, ...]:
    """Return the sections of an entry with entries that are repeated, or may be left out.

    Components may name parameter files, too.
    """
    return tuple(
        key
        for key, section in (node.items() if isinstance(node, dict) else ())
        if (key in KIND_OF_SECTION and has_conditions(section))
        or (key == 'components' and isinstance(section, dict))
    )


def _with_scope(entry: Any, path: DataPath, evaluator: TemplateEvaluator) -> Any:
    """Return an entry with what is in scope for the expressions in its parameter files."""
    files = entry.get('parameter_files') if isinstance(entry, dict) else None
    if not isinstance(files, list):
        return entry
    given = []
    for index, each in enumerate(files):
        at = (*path, 'parameter_files', index, 'expressions')
        if isinstance(each, dict) and each.get('expressions') is True:
            given.append(each | {'expressions': dict(evaluator.scope.values)})
            # What is a sample has a place of its own, in which nothing is written.
            here = replace(evaluator.positions.value(at), length=0)
            evaluator.positions.values.update(
                {(*at, name): here for name in evaluator.scope.samples}
            )
            evaluator.document.sampled += [here] if evaluator.scope.samples else []
        else:
            given.append(each)
    return entry | {'parameter_files': given}
