"""Calls of Python's own functions, and of its library."""

from __future__ import annotations

import ast
import builtins
from typing import TYPE_CHECKING, cast

from composer.inference.current_run import name_place
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.waiting import MADE
from composer.inference.values import (
    BY_PARAMETER,
    CHOSEN,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    BoundMethod,
    Constant,
    External,
    Function,
    Generated,
    Mapping,
    Message,
    MessageClass,
    Partial,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    are_chosen,
    constant,
    is_chosen,
    join,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

# What functions return, whatever they are called with.
_BY_TYPE: dict[type, str] = {
    bool: 'builtins.all builtins.any builtins.bool builtins.callable builtins.issubclass '
    'math.isclose math.isfinite math.isinf math.isnan',
    int: 'builtins.hash builtins.id builtins.int builtins.ord math.ceil math.floor '
    'math.trunc random.randint random.randrange time.monotonic_ns time.time_ns',
    float: 'builtins.float math.acos math.asin math.atan math.atan2 math.copysign math.cos '
    'math.cosh math.degrees math.dist math.exp math.fabs math.fmod math.fsum math.hypot math.log '
    'math.log10 math.log2 math.modf math.pow math.radians math.remainder math.sin math.sinh '
    'math.sqrt math.tan math.tanh random.gauss random.random random.uniform time.monotonic '
    'time.perf_counter time.process_time time.time',
    str: 'builtins.ascii builtins.bin builtins.chr builtins.format builtins.hex builtins.input '
    'builtins.oct builtins.repr builtins.str json.dumps os.getcwd platform.node '
    'socket.gethostname',
    bytes: 'builtins.bytes os.urandom pickle.dumps struct.pack',
}
_BY_TYPE[float] = _BY_TYPE[float].replace(' math.modf', '')

_KNOWN_RESULTS: dict[str, Value] = {
    name: Scalar(kind) for kind, names in _BY_TYPE.items() for name in names.split()
}
_KNOWN_RESULTS |= {
    **dict.fromkeys(('math.pi', 'math.e', 'math.tau', 'math.inf', 'math.nan'), Scalar(float)),
    'builtins.print': NONE,
    'time.sleep': NONE,
}
# Functions that return the same for the same arguments are in these.
_PURE = ('builtins.', 'math.', 'copy.', 'functools.', 'operator.')
# How long a `range` is that is followed item by item.
_LONGEST_RANGE = 256
# How long one is whose numbers are followed, too.
_LONGEST_KNOWN_RANGE = 16


class LibraryCalls(Part):
    """Evaluates calls of Python's own functions."""

    def call(self, name: str, arguments: Arguments, place: Place) -> Value:
        """Return what a call of a function may return, by its full name: `builtins.len`."""
        if name in MADE:
            return self._evaluator.waiting.make(name, arguments, place)
        if name == 'time.sleep':
            length = arguments.get(0, 'secs') or Argument(UNKNOWN, place)
            self._evaluator.waiting.sleep(length, place)
        elif not name.startswith(_PURE):
            self._evaluator.run.moves += 1
        method = getattr(self, f'_call_{name.replace(".", "_")}', None)
        if method is not None:
            return cast('Value', method(arguments, place))
        if name in _KNOWN_RESULTS:
            if not name.startswith('builtins.is'):
                self._escape_functions(arguments)
            result = _KNOWN_RESULTS[name]
            if isinstance(result, Scalar) and are_chosen(arguments):
                return Scalar(result.kind, is_chosen=BY_PARAMETER)
            return result
        self._evaluator.calls.escape_all(arguments)
        return CHOSEN if are_chosen(arguments) else UNKNOWN

    def _escape_functions(self, arguments: Arguments) -> None:
        """Follow functions that are called back; nothing else is kept or changed."""
        for argument in arguments.all():
            if isinstance(argument.value, Function | Partial | BoundMethod):
                self._evaluator.escape(argument.value)

    def _call_builtins_getattr(self, arguments: Arguments, place: Place) -> Value:
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
                return UNKNOWN
            with self._evaluator.run.guard(is_guard=has_default):
                where = name_place(name, each)
                found.append(self._evaluator.attributes.read(owner.value, each.value, where))
        del place
        return UNKNOWN if has_default else join(found)

    def _call_builtins_setattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name, value = (arguments.get(index, '') for index in range(3))
        if owner is None or name is None or value is None:
            return NONE
        if isinstance(name.value, Constant) and isinstance(name.value.value, str):
            where = name_place(name, name.value)
            self._evaluator.attributes.store(owner.value, name.value.value, value.value, where)
        elif owner.value == PartOfNode('state'):
            self._evaluator.run.reading.is_state_open = True
        del place
        return NONE

    def _call_builtins_hasattr(self, arguments: Arguments, place: Place) -> Value:
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
        if isinstance(owner.value, Message):
            description = self._evaluator.run.types.describe(owner.value.type)
            if description is not None and not str(name.value.value).startswith('_'):
                has = description.field(str(name.value.value)) is not None
                return constant(has) if has or not str(name.value.value).isupper() else UNKNOWN
        return Scalar(bool)

    def _call_builtins_isinstance(self, arguments: Arguments, place: Place) -> Value:
        value, classes = arguments.get(0, ''), arguments.get(1, '')
        del place
        if value is None or classes is None:
            return Scalar(bool)
        wanted = classes.value
        several = [item for item, _ in wanted.items] if isinstance(wanted, Sequence) else [wanted]
        answers = {_is_instance(value.value, each) for each in several}
        if True in answers:
            return constant(value=True)
        return Scalar(bool) if None in answers else constant(value=False)

    def _call_builtins_vars(self, arguments: Arguments, place: Place) -> Value:
        self._evaluator.calls.escape_all(arguments)
        del place
        return UNKNOWN

    def _call_builtins_dict(self, arguments: Arguments, place: Place) -> Value:
        made = Mapping({}, arguments.is_open, self._evaluator.run.conditions)
        for argument in arguments.positional:
            self._evaluator.containers.update_mapping(made, argument.value, argument.place)
        for name, argument in arguments.named:
            self._evaluator.containers.set_item(made, name, argument.value, argument.place)
        del place
        return made

    def _call_builtins_list(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        if first is None:
            return Sequence([], list)
        if isinstance(first.value, Sequence):
            given = first.value
            return Sequence(list(given.items), list, given.is_open, given.is_lost)
        return Sequence([(self._evaluator.item_of(first.value), place)], list, is_open=True)

    _call_builtins_tuple = _call_builtins_list

    def _call_builtins_sorted(self, arguments: Arguments, place: Place) -> Value:
        self._call_key(arguments, place)
        return self._call_builtins_list(Arguments(arguments.positional[:1]), place)

    def _call_key(self, arguments: Arguments, place: Place) -> None:
        """Follow the function `key` of `sorted`, `min` and `max`."""
        key, first = dict(arguments.named).get('key'), arguments.get(0, '')
        if key is not None and first is not None:
            item = Argument(self._evaluator.item_of(first.value), first.place)
            self._evaluator.calls.invoke(key.value, Arguments((item,)), place, waits=False)

    def _call_builtins_map(self, arguments: Arguments, place: Place) -> Value:
        function, *iterated = arguments.positional
        items = tuple(
            Argument(self._evaluator.item_of(each.value), each.place) for each in iterated
        )
        with self._evaluator.run.condition():
            result = self._evaluator.calls.invoke(
                function.value, Arguments(items), place, waits=False
            )
        return Generated(result, NONE)

    def _call_builtins_filter(self, arguments: Arguments, place: Place) -> Value:
        if len(arguments.positional) != 2:  # noqa: PLR2004
            return UNKNOWN
        self._call_builtins_map(arguments, place)
        return Generated(self._evaluator.item_of(arguments.positional[1].value), NONE)

    def _call_builtins_range(self, arguments: Arguments, place: Place) -> Value:
        limits = [each.value for each in arguments.positional]
        known = [each.value for each in limits if isinstance(each, Constant) and each.kind is int]
        if len(known) == len(limits) > 0 and 0 not in known[2:]:
            length = len(range(*known))
            if length <= _LONGEST_KNOWN_RANGE:
                chosen = max(map(is_chosen, limits))
                numbers = [constant(each, is_chosen=chosen) for each in range(*known)]
                return Sequence([(each, place) for each in numbers], range)
            if length <= _LONGEST_RANGE:
                return Sequence([(Scalar(int), place)] * length, range)
        return Sequence([(Scalar(int), place)], range, is_open=True)

    def _call_builtins_enumerate(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, 'iterable')
        item = self._evaluator.item_of(first.value) if first else UNKNOWN
        begin = arguments.get(1, 'start')
        start = begin.value if begin else constant(0)
        items = self._evaluator.loops.items_of(first.value) if first else None
        pair = Sequence([(Scalar(int), place), (item, place)], tuple)
        if items is None or not isinstance(start, Constant) or start.kind is not int:
            return Generated(pair, NONE)
        numbers = [constant(start.value + index) for index in range(len(items))]
        pairs = zip(numbers, items, strict=True)
        return Generated(pair, NONE, items=tuple(_row(each, place) for each in pairs))

    def _call_builtins_zip(self, arguments: Arguments, place: Place) -> Value:
        items = [(self._evaluator.item_of(each.value), place) for each in arguments.positional]
        item = Sequence(items, tuple, arguments.is_open)
        several = [self._evaluator.loops.items_of(each.value) for each in arguments.positional]
        known = [each for each in several if each is not None]
        if arguments.is_open or arguments.named or len(known) < len(several):
            return Generated(item, NONE)
        rounds = zip(*known, strict=False)
        return Generated(item, NONE, items=tuple(_row(each, place) for each in rounds))

    def _call_builtins_reversed(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        return Generated(self._evaluator.item_of(first.value) if first else UNKNOWN, NONE)

    _call_builtins_iter = _call_builtins_reversed

    def _call_builtins_abs(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        found = alternatives(first.value) if first else (UNKNOWN,)
        return join(
            Scalar(each.kind, each.is_chosen)
            if isinstance(each, Constant | Scalar) and each.kind in (int, float)
            else UNKNOWN
            for each in found
        )

    def _call_builtins_max(self, arguments: Arguments, place: Place) -> Value:
        if len(arguments.positional) < 2 or arguments.is_open:  # noqa: PLR2004
            first = arguments.get(0, '')
            self._call_key(arguments, place)
            return self._evaluator.item_of(first.value) if first else UNKNOWN
        return join(
            self._call_builtins_abs(Arguments((each,)), place) for each in arguments.positional
        )

    _call_builtins_min = _call_builtins_max

    def _call_builtins_type(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        if first is not None and isinstance(first.value, Message):
            return MessageClass(first.value.type)
        return UNKNOWN

    def _call_builtins_len(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        value = first.value if first else UNKNOWN
        if isinstance(value, Sequence) and value.is_whole:
            held = [item for item, _ in value.items]
            return constant(len(held), is_chosen=max(map(is_chosen, held), default=0))
        return Scalar(int, is_chosen(value))

    def _call_builtins_round(self, arguments: Arguments, place: Place) -> Value:
        del place
        return Scalar(int) if len(arguments.positional) == 1 else UNKNOWN

    def _call_copy_copy(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, 'x')
        del place
        match first.value if first else UNKNOWN:
            case Mapping() as given:
                entries = dict(given.entries)
                return Mapping(
                    entries, given.is_open, self._evaluator.run.conditions, given.is_lost
                )
            case Sequence() as given:
                return Sequence(list(given.items), given.kind, given.is_open, given.is_lost)
            case Message() | Constant() | Scalar() as given:
                return given
        return UNKNOWN

    _call_copy_deepcopy = _call_copy_copy

    def _call_functools_partial(self, arguments: Arguments, place: Place) -> Value:
        del place
        if not arguments.positional:
            return UNKNOWN
        rest = Arguments(arguments.positional[1:], arguments.named, arguments.is_open)
        return Partial(arguments.positional[0].value, rest)


def _row(values: Iterable[Value], place: Place) -> Sequence:
    return Sequence([(each, place) for each in values], tuple)


def _is_instance(value: Value, wanted: Value) -> bool | None:
    """Return whether a value is of a class, if that is known."""
    found = {_is_one_instance(each, wanted) for each in alternatives(value)}
    return found.pop() if len(found) == 1 else None


def _is_one_instance(value: Value, wanted: Value) -> bool | None:
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
