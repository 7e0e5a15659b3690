"""`match`: which of its cases may be taken, and what their patterns store."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.evaluation.library.library_calls import is_instance
from composer.inference.evaluation.operators import compare
from composer.inference.evaluation.part import Part
from composer.inference.scopes import Names, Scope, join_names
from composer.inference.statements.narrowing import doubt_rounds
from composer.inference.values import (
    UNKNOWN,
    Alternatives,
    Constant,
    Instance,
    Mapping,
    Message,
    MessageClass,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    is_chosen,
    join,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

# Whether a pattern matches, as far as that is known; and what the value is if it does.
_Outcome = tuple[bool | None, Value]


class MatchCases(Part):
    """Follows `match`."""

    def follow(self, node: ast.Match, scope: Scope) -> None:
        """Follow the cases that may be taken."""
        evaluator = self._evaluator
        subject = evaluator.evaluate(node.subject, scope)
        evaluator.run.decide(subject)
        before = scope.copy_names()
        ends: list[Names | None] = []
        is_over = False
        for case in node.cases:
            scope.names = None if before is None else dict(before)
            matches, value = self._match(case.pattern, subject, scope)
            if isinstance(node.subject, ast.Name) and not isinstance(case.pattern, ast.MatchAs):
                scope.set(node.subject.id, value)
            if case.guard is not None:
                matches = _both(matches, truth_of(evaluator.tested(case.guard, scope)))
            if matches is None:
                doubt_rounds(node.subject, scope)
            test = self._test(False if is_over else matches, subject)
            with evaluator.branch(test, is_taken=True):
                evaluator.statements.follow_all(case.body, scope)
            if truth_of(test) is not False:
                ends.append(scope.names)
            is_over |= matches is True
        scope.names = join_names([None if is_over else before, *ends])

    def _test(self, matches: bool | None, subject: Value) -> Value:  # noqa: FBT001
        if matches is None:
            return Scalar(bool, is_chosen(subject))
        return constant(matches, is_chosen=is_chosen(subject))

    def _match(self, pattern: ast.pattern, subject: Value, scope: Scope) -> _Outcome:
        """Return whether a pattern matches, and store what it captures."""
        outcomes = [self._match_one(pattern, each, scope) for each in alternatives(subject)]
        kept = [(matches, value) for matches, value in outcomes if matches is not False]
        if len(outcomes) > 1 and kept:
            # What it captures is of those that it matches.
            self._match_one(pattern, join(value for _, value in kept), scope)
        if not kept:
            return False, UNKNOWN
        is_sure = len(kept) == len(outcomes) and all(matches for matches, _ in kept)
        return True if is_sure else None, join(value for _, value in kept)

    def _match_one(self, pattern: ast.pattern, subject: Value, scope: Scope) -> _Outcome:
        match pattern:
            case ast.MatchValue():
                value = self._evaluator.evaluate(pattern.value, scope)
                place = Place(scope.module, pattern.value)
                if not isinstance(subject, Alternatives):
                    self._evaluator.expressions.check_equality(ast.Eq(), subject, value, place)
                return truth_of(compare(ast.Eq(), subject, value)), subject
            case ast.MatchSingleton():
                return truth_of(compare(ast.Is(), subject, constant(pattern.value))), subject
            case ast.MatchAs():
                return self._capture(pattern, subject, scope)
            case ast.MatchOr():
                outcomes = [self._match(each, subject, scope) for each in pattern.patterns]
                self._forget(_captured(pattern), scope)
                kept = [(matches, value) for matches, value in outcomes if matches is not False]
                matches = True if any(each for each, _ in kept) else None if kept else False
                return matches, join(value for _, value in kept) if kept else UNKNOWN
            case ast.MatchClass():
                return self._match_class(pattern, subject, scope)
            case ast.MatchSequence():
                return self._match_sequence(pattern, subject, scope), subject
            case ast.MatchMapping():
                return self._match_mapping(pattern, subject, scope), subject
        self._forget(_captured(pattern), scope)
        return None, subject

    def _capture(self, pattern: ast.MatchAs, subject: Value, scope: Scope) -> _Outcome:
        outcome: _Outcome = (True, subject)
        if pattern.pattern is not None:
            outcome = self._match(pattern.pattern, subject, scope)
        if pattern.name:
            scope.set(pattern.name, outcome[1])
        return outcome

    def _match_class(self, pattern: ast.MatchClass, subject: Value, scope: Scope) -> _Outcome:
        wanted = self._evaluator.evaluate(pattern.cls, scope)
        if isinstance(subject, Instance):
            return self._match_object(pattern, subject, wanted, scope)
        matches = is_instance(subject, wanted)
        value = subject if matches else UNKNOWN
        if isinstance(wanted, MessageClass) and matches is not False:
            value = subject if isinstance(subject, Message) else Message(wanted.type)
        if matches is False:
            self._forget(_captured(pattern), scope)
            return False, UNKNOWN
        for each in pattern.patterns:
            # `int(x)` captures the number itself.
            matches = _both(matches, self._match(each, value, scope)[0])
        for name, each in zip(pattern.kwd_attrs, pattern.kwd_patterns, strict=True):
            held: Value = UNKNOWN
            if isinstance(value, Message):
                attribute = ast.copy_location(ast.Attribute(pattern.cls, name), pattern)
                place = Place(scope.module, attribute)
                held = self._evaluator.attributes.read(value, name, place)
            matches = _both(matches, self._match(each, held, scope)[0])
        return matches, value

    def _match_object(
        self, pattern: ast.MatchClass, subject: Instance, wanted: Value, scope: Scope
    ) -> _Outcome:
        classes = self._evaluator.classes
        matches = classes.is_instance(subject, wanted)
        if matches is False:
            self._forget(_captured(pattern), scope)
            return False, UNKNOWN
        names = [*(classes.fields_of(subject) or ()), *['…'] * len(pattern.patterns)]
        held = [
            *zip(names, pattern.patterns, strict=False),
            *zip(pattern.kwd_attrs, pattern.kwd_patterns, strict=True),
        ]
        for name, each in held:
            value = classes.read(subject, name)
            matches = _both(matches, self._match(each, value, scope)[0])
        return matches, subject

    def _match_sequence(
        self, pattern: ast.MatchSequence, subject: Value, scope: Scope
    ) -> bool | None:
        has_star = any(isinstance(each, ast.MatchStar) for each in pattern.patterns)
        if isinstance(subject, Constant | Scalar | Mapping | Message):
            self._forget(_captured(pattern), scope)
            return False
        if isinstance(subject, Sequence) and subject.is_whole and not has_star:
            if len(subject.items) != len(pattern.patterns):
                self._forget(_captured(pattern), scope)
                return False
            pairs = zip(pattern.patterns, subject.items, strict=True)
            found = [self._match(each, value, scope)[0] for each, (value, _) in pairs]
            return False if False in found else None if None in found else True
        for each in pattern.patterns:
            self._match(each, self._evaluator.item_of(subject), scope)
        return None

    def _match_mapping(
        self, pattern: ast.MatchMapping, subject: Value, scope: Scope
    ) -> bool | None:
        matches: bool | None = True if isinstance(subject, Mapping) else None
        for key, each in zip(pattern.keys, pattern.patterns, strict=True):
            name = self._evaluator.evaluate(key, scope)
            held: Value = UNKNOWN
            if isinstance(subject, Mapping) and not subject.is_lost and isinstance(name, Constant):
                found = subject.entries.get(name.value)
                matches = _both(matches, True if found else None if subject.is_open else False)
                held = found[0] if found else UNKNOWN
            else:
                matches = None
            matches = _both(matches, self._match(each, held, scope)[0])
        if pattern.rest:
            scope.set(pattern.rest, UNKNOWN)
        return matches

    def _forget(self, names: Iterable[str], scope: Scope) -> None:
        for name in names:
            scope.set(name, UNKNOWN)


def _both(one: bool | None, other: bool | None) -> bool | None:  # noqa: FBT001
    """Return whether two things are true, as far as that is known."""
    if one is False or other is False:
        return False
    return True if one and other else None


def _captured(pattern: ast.pattern) -> set[str]:
    names = {getattr(node, 'name', None) for node in ast.walk(pattern)}
    names |= {getattr(node, 'rest', None) for node in ast.walk(pattern)}
    return {name for name in names if name}
