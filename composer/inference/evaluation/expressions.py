"""Expressions: what each may be."""

from __future__ import annotations

import ast
import operator
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from composer.inference.evaluation.library.known_values import (
    Computation,
    NotKnownError,
    leaves_of,
)
from composer.inference.evaluation.operators import (
    OPERATIONS,
    combine,
    compare,
    is_never_equal,
    negate,
    refuses_time,
    type_in_words,
)
from composer.inference.evaluation.part import Part
from composer.inference.message_types import item_of
from composer.inference.scopes import Names, Scope, join_names
from composer.inference.values import (
    ANY,
    NONE,
    UNKNOWN,
    Alternatives,
    ArrayField,
    Awaitable,
    Constant,
    Generated,
    Instance,
    Mapping,
    Message,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    constant,
    is_chosen,
    join,
    once_set,
    pattern_of,
    truth_of,
)
from composer.python_source.local_names import list_arguments

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


_KINDS: dict[type[ast.expr], type] = {ast.List: list, ast.Tuple: tuple, ast.Set: set}
_UNREAD = (ast.Slice,)
_NOT_AWAITED = (Message, Constant, Scalar, Mapping, Sequence, PartOfNode)
# Expressions that make a value, rather than find one.
_MAKING = (ast.BinOp, ast.Call, ast.JoinedStr, ast.UnaryOp)
_NO_CONVERSION = -1
# Of more texts, none is known.
_MOST_TEXTS = 16
_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: 'add',
    ast.BitAnd: 'and',
    ast.BitOr: 'or',
    ast.BitXor: 'xor',
    ast.Div: 'truediv',
    ast.FloorDiv: 'floordiv',
    ast.LShift: 'lshift',
    ast.MatMult: 'matmul',
    ast.Mod: 'mod',
    ast.Mult: 'mul',
    ast.Pow: 'pow',
    ast.RShift: 'rshift',
    ast.Sub: 'sub',
}


class Expressions(Part):
    """Evaluates expressions."""

    def evaluate(self, node: ast.expr, scope: Scope) -> Value:
        """Return what an expression may be."""
        self._evaluator.run.step()
        method = getattr(self, f'_{type(node).__name__.lower()}', None)
        if method is None:
            self._evaluate_all(ast.iter_child_nodes(node), scope)
            return UNKNOWN
        value = cast('Value', method(node, scope))
        if isinstance(value, Scalar) and value.origin is None and isinstance(node, _MAKING):
            return replace(value, origin=Place(scope.module, node))
        return value

    def _evaluate_all(self, nodes: Iterable[ast.AST], scope: Scope) -> None:
        for node in nodes:
            if isinstance(node, ast.expr):
                self.evaluate(node, scope)
            else:
                self._evaluate_all(ast.iter_child_nodes(node), scope)

    # Names and literals

    def _constant(self, node: ast.Constant, scope: Scope) -> Value:
        if node.value is ... or isinstance(node.value, complex):
            return UNKNOWN
        return constant(node.value, Place(scope.module, node))

    def _name(self, node: ast.Name, scope: Scope) -> Value:
        return self._evaluator.look_up(node, scope)

    def _joinedstr(self, node: ast.JoinedStr, scope: Scope) -> Value:
        texts = ['']
        chosen = 0
        for part in node.values:
            value: Value = constant(getattr(part, 'value', None))
            if isinstance(part, ast.FormattedValue):
                value = self._evaluator.awaited(part.value, scope)
                if part.format_spec is not None:
                    given = self.evaluate(part.format_spec, scope)
                    if part.conversion == _NO_CONVERSION and isinstance(given, Constant):
                        place = Place(scope.module, part.value)
                        self._evaluator.refuse(place, _formatter(str(given.value)), value)
                if part.format_spec is not None or part.conversion != _NO_CONVERSION:
                    value = Scalar(str, is_chosen(value))
            chosen = max(chosen, is_chosen(value))
            several = [each for each in alternatives(value) if isinstance(each, Constant)]
            simple = all(isinstance(each.value, str | int) for each in several)
            is_known = simple and len(several) == len(alternatives(value))
            parts = [each.value for each in several] if is_known else [pattern_of(value)]
            texts = [f'{text}{each}' for text in texts for each in parts]
        place = Place(scope.module, node)
        if len(texts) > _MOST_TEXTS or any(ANY in each for each in texts):
            return Scalar(str, chosen, place, pattern=texts[0] if len(texts) == 1 else '')
        return join(constant(text, place, is_chosen=chosen) for text in texts)

    def _list(self, node: ast.List | ast.Tuple | ast.Set, scope: Scope) -> Value:
        items: list[tuple[Value, Place]] = []
        is_open = False
        for each in node.elts:
            if isinstance(each, ast.Starred):
                is_open = self._extend(items, each, scope) or is_open
            else:
                items.append((self.evaluate(each, scope), Place(scope.module, each)))
        origin = Place(scope.module, node)
        return Sequence(items, _KINDS[type(node)], is_open, origin=origin)

    _tuple = _set = _list

    def _extend(self, items: list[tuple[Value, Place]], node: ast.Starred, scope: Scope) -> bool:
        """Add the items of `*value`; return whether there may be others."""
        value = self.evaluate(node.value, scope)
        if isinstance(value, Sequence) and not value.is_lost:
            items += value.items
            return value.is_open
        items.append((self._evaluator.item_of(value), Place(scope.module, node)))
        return True

    def _dict(self, node: ast.Dict, scope: Scope) -> Value:
        made = Mapping({}, depth=self._evaluator.run.conditions)
        for key, value in zip(node.keys, node.values, strict=True):
            held = self.evaluate(value, scope)
            if key is None:
                self._evaluator.containers.update_mapping(made, held, Place(scope.module, value))
                continue
            name = self.evaluate(key, scope)
            if isinstance(name, Constant):
                place = Place(scope.module, key)
                made.set(name.value, held, place, made.depth)
            else:
                made.is_open = True
        return made

    # Operators

    def _binop(self, node: ast.BinOp, scope: Scope) -> Value:
        # A sum of hundreds of terms nests as deep.
        chain = [node]
        while isinstance(chain[-1].left, ast.BinOp):
            chain.append(chain[-1].left)
        value = self._evaluator.awaited(chain[-1].left, scope)
        for each in reversed(chain):
            right = self._evaluator.awaited(each.right, scope)
            self.check_operands(each.op, value, right, Place(scope.module, each))
            if isinstance(value, Mapping) and isinstance(right, Mapping):
                value = self._merge(value, right)
            elif any(isinstance(one, Instance) for one in (value, right)):
                value = self._call_operator(each.op, value, right)
            else:
                value = combine(each.op, value, right)
        return value

    def check_operands(
        self, sign: ast.operator | ast.cmpop, left: Value, right: Value, place: Place
    ) -> None:
        """Report values that an operator does not take."""
        if type(sign) in OPERATIONS:
            self._evaluator.refuse(place, OPERATIONS[type(sign)], left, right)
        if refuses_time(sign, left, right):
            text = 'a time of rclpy is combined only with durations and other times'
            help_text = 'write .nanoseconds, or rclpy.time.Time.from_msg(stamp)'
            self._evaluator.run.report('bad-call', place, text, help_text)

    def _call_operator(self, sign: ast.operator, left: Value, right: Value) -> Value:
        """Return what the method of an object makes of an operator: `__add__`."""
        name = _OPERATORS[type(sign)]
        classes = self._evaluator.classes
        found: Value | None = None
        if isinstance(left, Instance):
            found = classes.call_method(left, f'__{name}__', right)
        if found is None and isinstance(right, Instance):
            found = classes.call_method(right, f'__r{name}__', left)
        if found is None:
            self._evaluator.escape(left)
            self._evaluator.escape(right)
        return UNKNOWN if found is None else found

    def _merge(self, left: Mapping, right: Mapping) -> Value:
        if left.is_lost or right.is_lost:
            return UNKNOWN
        entries = {**left.entries, **right.entries}
        return Mapping(entries, left.is_open or right.is_open, self._evaluator.run.conditions)

    def _unaryop(self, node: ast.UnaryOp, scope: Scope) -> Value:
        operand = self._evaluator.awaited(node.operand, scope)
        if isinstance(node.op, ast.USub):
            self._evaluator.refuse(Place(scope.module, node), operator.neg, operand)
        value = negate(node.op, operand)
        if isinstance(value, Constant) and value.origin is not None:
            return constant(value.value, Place(scope.module, node), is_chosen=value.is_chosen)
        return value

    def _compare(self, node: ast.Compare, scope: Scope) -> Value:
        left = self._evaluator.awaited(node.left, scope)
        chosen = 0
        for sign, operand in zip(node.ops, node.comparators, strict=True):
            right = self.evaluate(operand, scope)
            self.check_operands(sign, left, right, Place(scope.module, node))
            if not self._is_given(node, scope):
                self.check_equality(sign, left, right, Place(scope.module, node))
            if isinstance(sign, ast.In | ast.NotIn):
                self._evaluator.attributes.note_containment(
                    left, right, Place(scope.module, node.left)
                )
            said = self._evaluator.attributes.contained(sign, left, right)
            said = said or compare(sign, left, right)
            chosen = max(chosen, is_chosen(said))
            if len(node.ops) == 1:
                return said
            left = right
        return Scalar(bool, chosen)

    def check_equality(self, sign: ast.cmpop, left: Value, right: Value, place: Place) -> None:
        """Report values that are never equal."""
        if is_never_equal(sign, left, right):
            shown = f'{type_in_words(left)} and {type_in_words(right)}'
            text = f'values of these types are never equal: {shown}'
            self._evaluator.run.report('never-equal', place, text)

    def _is_given(self, node: ast.Compare, scope: Scope) -> bool:
        """Return whether a helper compares its own arguments: other calls give it others."""
        if scope.function is None or len(self._evaluator.functions.active) == 1:
            return False
        given = {each.arg for each in list_arguments(scope.function.definition.args)}
        return any(isinstance(each, ast.Name) and each.id in given for each in ast.walk(node))

    def _boolop(self, node: ast.BoolOp, scope: Scope) -> Value:
        """`a and b` comes to `b` if `a` is true; of `a or b`, if `a` is false."""
        goes_on = isinstance(node.op, ast.And)
        evaluator = self._evaluator
        found: list[Value] = []
        is_reached = True
        before: Names | None = None
        with ExitStack() as conditions:
            for index, each in enumerate(node.values):
                value = evaluator.tested(each, scope)
                before = before or scope.copy_names()
                is_last = index == len(node.values) - 1
                truth = truth_of(value)
                if is_reached and (truth is None or truth != goes_on or is_last):
                    found.append(value)
                if not is_last:
                    evaluator.narrowing.narrow(each, scope, value, is_true=goes_on)
                    is_reached = is_reached and truth in (None, goes_on)
                    branch = evaluator.branch(value, is_taken=goes_on)
                    conditions.enter_context(branch)
        scope.names = join_names([before, scope.names])
        kept = [
            each
            for value in found[:-1]
            for each in alternatives(value)
            if truth_of(each) is not goes_on
        ]
        return join([*kept, *found[-1:]])

    def _ifexp(self, node: ast.IfExp, scope: Scope) -> Value:
        evaluator = self._evaluator
        test = evaluator.tested(node.test, scope)
        truth = truth_of(test)
        found: list[Value] = []
        before = scope.copy_names()
        ends: list[Names | None] = []
        for branch, taken in ((node.body, True), (node.orelse, False)):
            evaluator.narrowing.narrow(node.test, scope, test, is_true=taken)
            with evaluator.branch(test, is_taken=taken):
                value = evaluator.evaluate(branch, scope)
            if truth is None or truth == taken:
                found.append(once_set(value))
            elif is_chosen(test):
                evaluator.escape(value)
            ends.append(scope.names if any(map(_is_walrus, ast.walk(branch))) else before)
            scope.names = None if before is None else dict(before)
        scope.names = join_names(ends)
        value = join(found)
        if isinstance(value, Alternatives):
            return Alternatives(value.values, is_direct=True)
        return value

    # What is in something

    def _attribute(self, node: ast.Attribute, scope: Scope) -> Value:
        owner = self.evaluate(node.value, scope)
        return self._evaluator.attributes.read(owner, node.attr, Place(scope.module, node))

    def _subscript(self, node: ast.Subscript, scope: Scope) -> Value:
        owner = self.evaluate(node.value, scope)
        index = self.evaluate(node.slice, scope)
        self._evaluator.run.decide(index)
        if _is_globals(node.value) and isinstance(index, Constant):
            is_known = self._evaluator.run.modules.has_name(scope.module, index.value)
            return self._evaluator.top_value(scope.module, index.value) if is_known else UNKNOWN
        is_slice = isinstance(node.slice, _UNREAD)
        place = Place(scope.module, node.slice)
        self._evaluator.containers.check_key(owner, index, place)
        return join(
            self._item(each, index, place, is_slice=is_slice) for each in alternatives(owner)
        )

    def read_item(self, owner: Value, index: Value, place: Place) -> Value:
        """Return what `owner[index]` may be."""
        return join(self._item(each, index, place, is_slice=False) for each in alternatives(owner))

    def _slice(self, node: ast.Slice, scope: Scope) -> Value:
        """Return the limits of a slice, as a tuple."""
        limits: list[tuple[Value, Place]] = []
        for each in (node.lower, node.upper, node.step):
            value = self.evaluate(each, scope) if each is not None else NONE
            limits.append((value, Place(scope.module, each or node)))
        return Sequence(limits, tuple)

    def _item(self, owner: Value, index: Value, place: Place, *, is_slice: bool) -> Value:
        if not (is_slice or isinstance(owner, Message)):
            self._evaluator.refuse(place, operator.getitem, owner, index)
            self._evaluator.containers.check_index(owner, index, place)
        match owner:
            case ArrayField():
                if is_slice:
                    return self._evaluator.read_only.slice_of(owner, place)
                return item_of(owner)
            case Unknown(is_read_only=True) if is_slice:
                return owner
            case Mapping() if not owner.is_lost:
                return owner.value_of(index) or UNKNOWN
            case Sequence() if not owner.is_lost:
                if is_slice:
                    return self._slice_of(owner, index, place)
                at = index.value if isinstance(index, Constant) else None
                return owner.item_at(at if isinstance(at, int) else None)
            case Constant() | Scalar() if owner.kind is str:
                if isinstance(owner, Constant) and isinstance(index, Constant | Sequence):
                    return self._slice_of(owner, index, place)
                return Scalar(str, is_chosen(owner))
        return self._evaluator.attributes.read_item(owner, index, place)

    def _slice_of(self, owner: Sequence | Constant, index: Value, place: Place) -> Value:
        """Return what `owner[1:3]` gives, and of a text also `owner[1]`."""
        made = Computation(place)
        try:
            at = made.python(index)
            at = slice(*at) if isinstance(index, Sequence) else at
            if isinstance(owner, Sequence):
                leaves = leaves_of(owner, place)
                kind = list if owner.kind is list else tuple
                return made.call_plainly(lambda: kind(leaves[at]))
            return made.call(lambda text: text[at], owner)
        except NotKnownError:
            if isinstance(owner, Constant):
                return Scalar(str, is_chosen(owner))
            return Sequence([(owner.item(), place)], owner.kind, is_open=True)

    # Calls, functions and what waits

    def _call(self, node: ast.Call, scope: Scope) -> Value:
        return self._evaluator.calls.call(node, scope)

    def _lambda(self, node: ast.Lambda, scope: Scope) -> Value:
        return self._evaluator.functions.define(node, scope)

    def _await(self, node: ast.Await, scope: Scope) -> Value:
        if isinstance(node.value, ast.Call):
            value = self._evaluator.calls.call(node.value, scope, is_awaited=True)
        else:
            value = self.evaluate(node.value, scope)
        several = alternatives(value)
        if all(isinstance(each, _NOT_AWAITED) for each in several):
            place = Place(scope.module, node.value)
            text = 'what is awaited here is no coroutine'
            self._evaluator.run.report('missing-await', place, text, 'leave out the await')
        return join(each.result if isinstance(each, Awaitable) else UNKNOWN for each in several)

    def _yield(self, node: ast.Yield, scope: Scope) -> Value:
        value = self.evaluate(node.value, scope) if node.value else NONE
        home = self._evaluator.home_of(scope)
        if len(self._evaluator.functions.active) > 1:
            # Who goes through it has it meanwhile.
            held, value = value, self._evaluator.library.mappings.lasting_copy(value)
            self._evaluator.escape(held)
        home.yielded.append((value, Place(scope.module, node.value or node)))
        return UNKNOWN

    def _yieldfrom(self, node: ast.YieldFrom, scope: Scope) -> Value:
        value = self.evaluate(node.value, scope)
        home = self._evaluator.home_of(scope)
        if isinstance(value, Generated):
            home.yielded.append((value.yielded, Place(scope.module, node.value)))
            return value.returned
        home.yielded.append((self._evaluator.item_of(value), Place(scope.module, node.value)))
        return UNKNOWN

    def _namedexpr(self, node: ast.NamedExpr, scope: Scope) -> Value:
        value = self.evaluate(node.value, scope)
        home = self._evaluator.home_of(scope)
        before = (home.names or {}).get(node.target.id, UNKNOWN)
        # A comprehension may have no rounds.
        home.set(node.target.id, value if home is scope else join([before, value]))
        scope.set(node.target.id, value)
        return value

    def _starred(self, node: ast.Starred, scope: Scope) -> Value:
        return self.evaluate(node.value, scope)

    # Comprehensions

    def _listcomp(self, node: ast.ListComp | ast.SetComp, scope: Scope) -> Value:
        kind = list if isinstance(node, ast.ListComp) else set
        items, is_whole = self._items(node.elt, node.generators, scope)
        return Sequence(items, kind, not is_whole, origin=Place(scope.module, node))

    _setcomp = _listcomp

    def _generatorexp(self, node: ast.GeneratorExp, scope: Scope) -> Value:
        items, is_whole = self._items(node.elt, node.generators, scope)
        values = tuple(value for value, _ in items)
        return Generated(join(values), NONE, items=values if is_whole else None)

    def _items(
        self, element: ast.expr, generators: list[ast.comprehension], scope: Scope
    ) -> tuple[list[tuple[Value, Place]], bool]:
        """Return the items that a comprehension makes, and whether these are all."""
        items: list[tuple[Value, Place]] = []
        is_whole = True
        for inner, is_certain in self._evaluator.loops.rounds(generators, scope):
            items.append((self.evaluate(element, inner), Place(scope.module, element)))
            is_whole = is_whole and is_certain
        if not is_whole and len(generators) == len(items) == 1 and not generators[0].ifs:
            with self._evaluator.run.silence():
                iterated = self.evaluate(generators[0].iter, scope)
            if isinstance(iterated, Sequence) and iterated.is_whole:
                return items * len(iterated.items), True
        return items, is_whole

    def _dictcomp(self, node: ast.DictComp, scope: Scope) -> Value:
        run = self._evaluator.run
        made = Mapping({}, depth=run.conditions)
        for inner, is_certain in self._evaluator.loops.rounds(node.generators, scope):
            keys = self.evaluate(node.key, inner)
            value = self.evaluate(node.value, inner)
            for key in alternatives(keys):
                if isinstance(key, Constant):
                    made.set(key.value, value, Place(scope.module, node.key), run.conditions)
                    made.has_unknown |= not is_certain
                else:
                    made.set_other(value)
        return made


def _is_walrus(node: ast.AST) -> bool:
    return isinstance(node, ast.NamedExpr)


def _is_globals(node: ast.expr) -> bool:
    match node:
        case ast.Call(func=ast.Name('globals')):
            return True
    return False


def _formatter(form: str) -> Callable[[object], str]:
    """Return what formats a value, and refuses one of another type by a `TypeError`."""

    def formatted(value: object) -> str:
        try:
            return format(value, form)
        except ValueError as error:
            raise TypeError(str(error)) from error

    return formatted
