"""Calls of Python's own functions, and of its library."""

from __future__ import annotations

import ast
import builtins
from contextlib import suppress
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any

from composer.inference.current_run import name_place
from composer.inference.evaluation.library.array_calls import ArrayCalls
from composer.inference.evaluation.library.iterable_calls import IterableCalls
from composer.inference.evaluation.library.known_functions import (
    ARRANGED,
    COMPUTED,
    KNOWN_RESULTS,
    TAKING,
)
from composer.inference.evaluation.library.known_values import (
    Computation,
    NotKnownError,
    arrange,
)
from composer.inference.evaluation.library.mapping_calls import MappingCalls
from composer.inference.evaluation.operators import combine
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.waiting import MADE
from composer.inference.values import (
    BY_PARAMETER,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Awaitable,
    BoundMethod,
    Constant,
    External,
    Function,
    Instance,
    Mapping,
    Message,
    MessageClass,
    Partial,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    chosen_by,
    chosen_with,
    constant,
    is_none,
    join,
)

if TYPE_CHECKING:
    from collections.abc import Callable

# Of more combinations of values, nothing is computed.
_MOST_COMBINATIONS = 16
# Functions in these return the same for the same arguments.
_PURE = ('builtins.', 'math.', 'copy.', 'functools.', 'operator.')
# `str.upper(text)` is `text.upper()`.
# Functions for which only the truth of the items counts, or their number.
_TESTING_ITEMS = frozenset({'builtins.all', 'builtins.any', 'builtins.sum'})
_OF_TEXTS = 'builtins.str.'


class LibraryCalls(Part):
    """Evaluates calls of Python's own functions."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self.iterables = IterableCalls(evaluator)
        self.mappings = MappingCalls(evaluator)
        self._handlers: dict[str, Callable[[Arguments, Place], Value]] = {
            'builtins.divmod': self._divmod,
            'builtins.getattr': self._getattr,
            'builtins.hasattr': self._hasattr,
            'builtins.isinstance': self._isinstance,
            'builtins.abs': self._abs,
            'builtins.pow': self._pow,
            'builtins.round': self._round,
            'builtins.setattr': self._setattr,
            'builtins.type': self._type,
            'functools.partial': self._partial,
            **self.iterables.handlers(),
            **self.mappings.handlers(),
            **ArrayCalls(evaluator).handlers(),
        }

    def call(self, name: str, arguments: Arguments, place: Place) -> Value:
        """Return what a call of a function may return, by its full name: `builtins.len`."""
        if name in MADE:
            return self._evaluator.waiting.make(name, arguments, place)
        if name == 'threading.Timer' and (function := arguments.get(1, 'function')):
            self._evaluator.waiting.check_target(function)
        if name == 'time.sleep':
            length = arguments.get(0, 'secs') or Argument(UNKNOWN, place)
            self._evaluator.sleeping.sleep(length, place)
        elif not name.startswith(_PURE):
            self._evaluator.run.moves += 1
        if name in _TESTING_ITEMS:
            self._check_awaited(arguments)
        self._evaluator.read_only.check_call(name, arguments, place)
        known = self._compute(name, arguments, place)
        if known is not None:
            return known
        self.refuse(COMPUTED.get(name) or TAKING.get(name), arguments, place)
        if name in self._handlers:
            return self._handlers[name](arguments, place)
        if name.startswith(_OF_TEXTS) and arguments.positional and not arguments.is_open:
            method = BoundMethod(arguments.positional[0].value, name.removeprefix(_OF_TEXTS))
            rest = Arguments(arguments.positional[1:], arguments.named)
            return self._evaluator.containers.call_method(method, rest, place)
        if name in KNOWN_RESULTS:
            if not name.startswith('builtins.is'):
                self._escape_functions(arguments)
            result = KNOWN_RESULTS[name]
            # Who asks for a type's name asks which type it is.
            is_type = any(isinstance(each.value, MessageClass) for each in arguments.all())
            chosen = BY_PARAMETER if is_type else chosen_by(arguments)
            if isinstance(result, Scalar) and chosen:
                if result.kind in (int, float):
                    chosen = chosen_with(*(argument.value for argument in arguments.all()))
                return Scalar(result.kind, chosen)
            return result
        self._evaluator.calls.escape_all(arguments)
        is_view = self._evaluator.read_only.gives_view(name, arguments)
        return Unknown(chosen_by(arguments), is_read_only=is_view)

    def _check_awaited(self, arguments: Arguments) -> None:
        """Report coroutines in what is tested or counted: each of them counts as true."""
        first = arguments.get(0, '')
        for each in alternatives(first.value) if first else ():
            match each:
                case Sequence(items=[(Awaitable(), where), *_]):
                    text = 'this is a coroutine, which has not been awaited'
                    self._evaluator.run.report('missing-await', where, text, 'put await before it')

    def refuse(
        self, function: Callable[..., Any] | None, arguments: Arguments, place: Place
    ) -> None:
        """Report that a function of Python does not take values of the types of the arguments."""
        if function is not None and not arguments.is_open:
            given = [each.value for each in arguments.positional]
            named = {name: each.value for name, each in arguments.named}
            self._evaluator.refuse(place, function, *given, **named)

    def _compute(self, name: str, arguments: Arguments, place: Place) -> Value | None:
        """Return what a function returns if all that it is given is known."""
        if arguments.is_open:
            return None
        given = [argument.value for argument in arguments.positional]
        if name in ARRANGED and given and not arguments.named:
            with suppress(NotKnownError):
                return arrange(ARRANGED[name], given, place)
        return self.compute(COMPUTED.get(name), arguments, place)

    def compute(
        self, function: Callable[..., Any] | None, arguments: Arguments, place: Place
    ) -> Value | None:
        """Return what a function of Python makes of constants, and of containers of them."""
        several = [alternatives(argument.value) for argument in arguments.all()]
        if function is None or arguments.is_open or prod(map(len, several)) > _MOST_COMBINATIONS:
            return None
        count = len(arguments.positional)
        names = [name for name, _ in arguments.named]
        found: list[Value] = []
        for values in product(*several):
            named = dict(zip(names, values[count:], strict=True))
            try:
                found.append(Computation(place).call(function, *values[:count], **named))
            except NotKnownError:
                return None
        return join(found)

    def _escape_functions(self, arguments: Arguments) -> None:
        """Follow functions that are called back; nothing else is kept or changed."""
        for argument in arguments.all():
            if isinstance(argument.value, Function | Partial | BoundMethod):
                self._evaluator.escape(argument.value)

    def _getattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name = arguments.get(0, ''), arguments.get(1, '')
        if owner is None or name is None:
            return UNKNOWN
        has_default = len(arguments.positional) > 2  # noqa: PLR2004
        if owner.value == PartOfNode('parameters') and has_default:
            rest = Arguments(arguments.positional[1:])
            return self._evaluator.node_calls.read_parameters(owner.value, 'get', rest)
        found: list[Value] = []
        for each in alternatives(name.value):
            if not isinstance(each, Constant) or not isinstance(each.value, str):
                self._evaluator.escape(owner.value)
                if owner.value == PartOfNode('parameters') and not has_default:
                    self._evaluator.run.use_any('parameter', each, name.place)
                return UNKNOWN
            with self._evaluator.run.guard(is_guard=has_default):
                where = name_place(name, each)
                found.append(self._evaluator.attributes.read(owner.value, each.value, where))
        del place
        if has_default:
            self._evaluator.escape(join(found))
        return UNKNOWN if has_default else join(found)

    def _setattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name, value = (arguments.get(index, '') for index in range(3))
        if owner is None or name is None or value is None:
            return NONE
        del place
        names = alternatives(name.value)
        # Which value belongs to which name is not known.
        stored = value.value if len(names) == 1 else UNKNOWN
        for each in names:
            if isinstance(each, Constant) and isinstance(each.value, str):
                where = name_place(name, each)
                self._evaluator.attributes.store(owner.value, each.value, stored, where)
            elif owner.value == PartOfNode('state'):
                self._evaluator.run.reading.is_state_open = True
        return NONE

    def _hasattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name = arguments.get(0, ''), arguments.get(1, '')
        del place
        if owner is None or name is None or not isinstance(name.value, Constant):
            return Scalar(bool)
        if owner.value == PartOfNode('state'):
            self._evaluator.run.reading.state_tested.add(str(name.value.value))
            return Scalar(bool, BY_PARAMETER)
        if owner.value == PartOfNode('parameters'):
            contained = self._evaluator.attributes.contained(ast.In(), name.value, owner.value)
            self._evaluator.attributes.note_containment(name.value, owner.value, name.place)
            return contained or UNKNOWN
        kind = getattr(owner.value, 'kind', list)
        if isinstance(owner.value, Scalar | Constant) and kind is not list:
            return constant(hasattr(kind, str(name.value.value)))
        if isinstance(owner.value, Message):
            if name.value.value == 'get_fields_and_field_types':
                return constant(value=True)
            description = self._evaluator.run.types.describe(owner.value.type)
            if description is not None and not str(name.value.value).startswith('_'):
                has = description.field(str(name.value.value)) is not None
                return constant(has) if has or not str(name.value.value).isupper() else UNKNOWN
        return Scalar(bool)

    def _isinstance(self, arguments: Arguments, place: Place) -> Value:
        value, classes = arguments.get(0, ''), arguments.get(1, '')
        del place
        if value is None or classes is None:
            return Scalar(bool)
        wanted = classes.value
        several = [item for item, _ in wanted.items] if isinstance(wanted, Sequence) else [wanted]
        given = value.value
        if isinstance(given, Instance):
            answers = {self._evaluator.classes.is_instance(given, each) for each in several}
        else:
            answers = {is_instance(given, each) for each in several}
        if True in answers:
            return constant(value=True)
        return Scalar(bool) if None in answers else constant(value=False)

    def _abs(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        found = alternatives(first.value) if first else (UNKNOWN,)
        return join(
            Scalar(each.kind, each.is_chosen)
            if isinstance(each, Constant | Scalar) and each.kind in (int, float)
            else UNKNOWN
            for each in found
        )

    def _type(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        if first is not None and isinstance(first.value, Message):
            return MessageClass(first.value.type)
        return first.value.of if first and isinstance(first.value, Instance) else UNKNOWN

    def _round(self, arguments: Arguments, place: Place) -> Value:
        digits = arguments.get(1, 'ndigits')
        if digits is None or is_none(digits.value):
            return Scalar(int)
        return self._abs(arguments, place)

    def _divmod(self, arguments: Arguments, place: Place) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        if first is None or second is None:
            return UNKNOWN
        found = [combine(sign, first.value, second.value) for sign in (ast.FloorDiv(), ast.Mod())]
        return Sequence([(each, place) for each in found], tuple, origin=place)

    def _pow(self, arguments: Arguments, place: Place) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        del place
        if first is None or second is None:
            return UNKNOWN
        return combine(ast.Pow(), first.value, second.value)

    def _partial(self, arguments: Arguments, place: Place) -> Value:
        del place
        if not arguments.positional:
            return UNKNOWN
        rest = Arguments(arguments.positional[1:], arguments.named, arguments.is_open)
        return Partial(arguments.positional[0].value, rest)


def is_instance(value: Value, wanted: Value) -> bool | None:
    """Return whether a value is of a class, if that is known."""
    found = {_is_one_instance(each, wanted) for each in alternatives(value)}
    return found.pop() if len(found) == 1 else None


def _is_one_instance(value: Value, wanted: Value) -> bool | None:
    if isinstance(value, Scalar) and (value.unset or value.kind is list):
        return None
    if isinstance(value, Message) and isinstance(wanted, MessageClass):
        # Of two packages with the same type, either may be meant.
        same = value.type.rpartition('/')[2] == wanted.type.rpartition('/')[2]
        return value.type == wanted.type or (None if same else False)
    if isinstance(value, Message) and isinstance(wanted, External):
        return False if wanted.name.startswith('builtins.') else None
    if isinstance(wanted, External) and wanted.name.startswith('builtins.'):
        kind = getattr(builtins, wanted.name.removeprefix('builtins.'), None)
        own = dict if isinstance(value, Mapping) else getattr(value, 'kind', None)
        if isinstance(kind, type) and isinstance(own, type):
            return issubclass(own, kind)
    return None
