"""Functions and methods of Python that are called with known values, and what kind they return."""

from __future__ import annotations

import builtins
import itertools
import json
import math
import operator
import re
import struct
from collections import ChainMap, Counter, OrderedDict, defaultdict, deque
from datetime import date, datetime, timedelta
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import UUID

from composer.inference.values import NONE, PartOfNode, Scalar, Value

if TYPE_CHECKING:
    from collections.abc import Callable

# What functions return, whatever they are called with.
_BY_TYPE: dict[type, str] = {
    bool: 'builtins.all builtins.any builtins.bool builtins.callable builtins.issubclass '
    'math.isclose math.isfinite math.isinf math.isnan operator.contains operator.is_ '
    'operator.is_not operator.not_ operator.truth os.path.exists os.path.isfile os.path.isdir',
    int: 'builtins.hash builtins.id builtins.int builtins.int.from_bytes builtins.len '
    'builtins.ord '
    'math.ceil math.comb math.factorial math.floor math.gcd math.isqrt math.lcm math.perm '
    'math.trunc operator.countOf operator.indexOf os.getpid random.getrandbits random.randint '
    'random.randrange struct.calcsize time.monotonic_ns time.perf_counter_ns '
    'time.process_time_ns time.time_ns',
    float: 'builtins.float math.acos math.acosh math.asin math.asinh math.atan math.atan2 '
    'math.atanh math.cbrt math.copysign math.cos math.cosh math.degrees math.dist math.erf '
    'math.erfc math.exp math.exp2 math.expm1 math.fabs math.fmod math.fsum math.gamma math.hypot '
    'math.ldexp math.lgamma math.log math.log10 math.log1p math.log2 math.nextafter math.pow '
    'math.radians math.remainder math.sin math.sinh math.sqrt math.tan math.tanh math.ulp '
    'random.betavariate random.expovariate random.gauss random.normalvariate random.random '
    'random.triangular random.uniform statistics.fmean statistics.geometric_mean time.monotonic '
    'time.perf_counter time.process_time time.thread_time time.time',
    str: 'builtins.ascii builtins.bin builtins.chr builtins.format builtins.hex builtins.input '
    'builtins.oct builtins.repr builtins.str json.dumps os.getcwd os.path.basename '
    'os.path.dirname platform.node platform.system pprint.pformat socket.gethostname '
    'textwrap.dedent textwrap.fill textwrap.indent textwrap.shorten time.asctime time.ctime '
    'time.strftime',
    bytes: 'builtins.bytes os.urandom pickle.dumps struct.pack',
    type(Path()): 'pathlib.Path pathlib.Path.cwd pathlib.Path.home pathlib.PurePath',
    datetime: 'datetime.datetime datetime.datetime.now datetime.datetime.fromtimestamp '
    'datetime.datetime.utcnow datetime.datetime.today datetime.datetime.fromisoformat',
    date: 'datetime.date datetime.date.today',
    timedelta: 'datetime.timedelta',
    re.Match: 're.match re.search re.fullmatch',
    re.Pattern: 're.compile',
    UUID: 'uuid.UUID uuid.uuid1 uuid.uuid3 uuid.uuid4 uuid.uuid5',
    Decimal: 'decimal.Decimal',
    Fraction: 'fractions.Fraction',
    **{
        each: f'builtins.{each.__name__}'
        for each in vars(builtins).values()
        if isinstance(each, type) and issubclass(each, Exception)
    },
}
KNOWN_RESULTS: dict[str, Value] = {
    name: Scalar(kind) for kind, names in _BY_TYPE.items() for name in names.split()
}
KNOWN_RESULTS |= {'builtins.print': NONE, 'time.sleep': NONE}
KNOWN_RESULTS['rclpy.duration.Duration'] = PartOfNode('duration')
for _name in ('rclpy.time.Time', 'rclpy.time.Time.from_msg'):
    KNOWN_RESULTS[_name] = PartOfNode('time')
CONSTANTS: dict[str, float | str] = {
    **{f'math.{name}': getattr(math, name) for name in ('pi', 'e', 'tau', 'inf', 'nan')},
    **{
        f'string.{name}': value
        for name, value in (('digits', '0123456789'), ('hexdigits', '0123456789abcdefABCDEF'))
    },
}


def _power(base: Any, exponent: Any, *modulus: Any) -> Any:
    if abs(exponent) > _GREATEST_POWER:
        raise ValueError
    return pow(base, exponent, *modulus)


def _bytes(*values: Any) -> bytes:
    if values and isinstance(values[0], int):
        raise ValueError
    return bytes(*values)


def _shown(value: Any, spec: str = '') -> str:
    if _LARGE_WIDTH.search(spec):
        raise ValueError
    return format(value, spec)


def _of_statistics(name: str) -> Callable[..., Any]:
    def call(*values: Any, **options: Any) -> Any:
        # Few behaviours use it, and it imports much.
        import statistics

        return getattr(statistics, name)(*values, **options)

    return call


_GREATEST_POWER = 64
# `'{:100000}'` makes a long text.
_LARGE_WIDTH = re.compile(r'\d{4}')
_OF_BUILTINS = (
    'abs all any bin bool chr dict divmod float frozenset hex int len list max min oct ord repr '
    'reversed round set sorted str sum tuple'
)
_OF_MATH = (
    'ceil copysign cos degrees dist fabs floor fmod fsum gcd hypot isclose isfinite isinf isnan '
    'isqrt log log10 log2 prod radians remainder sin sqrt tan trunc atan2 acos asin atan exp'
)
_OF_OPERATOR = 'add sub mul truediv floordiv mod neg eq ne lt le gt ge and_ or_ xor not_ contains'
# Called with constants, and with lists, tuples, sets and dictionaries of them.
COMPUTED: dict[str, Callable[..., Any]] = {
    **{f'builtins.{name}': getattr(builtins, name) for name in _OF_BUILTINS.split()},
    **{f'math.{name}': getattr(math, name) for name in _OF_MATH.split()},
    **{f'operator.{name}': getattr(operator, name) for name in _OF_OPERATOR.split()},
    **{f'statistics.{name}': _of_statistics(name) for name in ('mean', 'fmean', 'median')},
    'builtins.bytes': _bytes,
    'builtins.format': _shown,
    'builtins.pow': _power,
    'collections.Counter': Counter,
    'itertools.accumulate': itertools.accumulate,
    'struct.calcsize': struct.calcsize,
    'struct.pack': struct.pack,
    'struct.unpack': struct.unpack,
}
TAKING: dict[str, Callable[..., Any]] = {
    **{f'builtins.{each.__name__}': each for each in (enumerate, iter, range, zip)},
    'json.dumps': json.dumps,
    'time.sleep': lambda seconds: range(0) if seconds < 0 else None,
}
# Called with containers whose items may be anything.
ARRANGED: dict[str, Callable[..., Any]] = {
    'builtins.enumerate': enumerate,
    'builtins.iter': iter,
    'builtins.list': list,
    'builtins.reversed': reversed,
    'builtins.tuple': tuple,
    'builtins.zip': zip,
    'collections.deque': deque,
    'itertools.chain': itertools.chain,
    'itertools.combinations': itertools.combinations,
    'itertools.islice': itertools.islice,
    'itertools.pairwise': itertools.pairwise,
    'itertools.permutations': itertools.permutations,
    'itertools.product': itertools.product,
}
# What a dictionary may be.
MAPPINGS = (dict, ChainMap, Counter, OrderedDict, defaultdict)

# Methods, by the types whose values they are called on; and the type of what they return.
_METHODS: dict[type, dict[type, str]] = {
    str: {
        str: 'capitalize casefold center expandtabs format format_map join ljust lower lstrip '
        'removeprefix removesuffix replace rjust rstrip strip swapcase title translate upper '
        'zfill',
        bool: 'endswith isalnum isalpha isascii isdecimal isdigit isidentifier islower isnumeric '
        'isprintable isspace istitle isupper startswith',
        int: 'count find index rfind rindex',
        bytes: 'encode',
        list: 'split rsplit splitlines',
        tuple: 'partition rpartition',
    },
    bytes: {
        str: 'decode hex',
        bytes: 'join ljust lower lstrip replace rjust rstrip strip upper zfill',
        bool: 'endswith startswith',
        int: 'count find index',
    },
    int: {int: 'bit_count bit_length conjugate', bytes: 'to_bytes', bool: 'is_integer'},
    bool: {int: 'bit_count bit_length conjugate', bytes: 'to_bytes'},
    float: {float: 'conjugate', bool: 'is_integer', str: 'hex'},
    set: {
        set: 'copy difference intersection symmetric_difference union',
        bool: 'isdisjoint issubset issuperset',
    },
    list: {int: 'count index'},
    tuple: {int: 'count index'},
    re.Pattern: {re.Match: 'match search fullmatch'},
}
METHODS: dict[type, dict[str, type]] = {
    owner: {name: kind for kind, names in kinds.items() for name in names.split()}
    for owner, kinds in _METHODS.items()
}


def call_method(name: str) -> Callable[..., Any]:
    """Return a function that calls a method, unless its result may be large."""

    def call(owner: Any, *arguments: Any, **named: Any) -> Any:
        texts = [each for each in (owner, *arguments) if isinstance(each, str)]
        is_formatted = name in ('format', 'format_map')
        if is_formatted and any(_LARGE_WIDTH.search(text) for text in texts):
            raise ValueError
        if any(isinstance(each, int) and abs(each) > _LONGEST for each in arguments):
            raise ValueError
        return getattr(owner, name)(*arguments, **named)

    return call


_LONGEST = 256
