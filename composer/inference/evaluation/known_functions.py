"""What functions of Python's library return, whatever they are called with."""

from __future__ import annotations

from composer.inference.values import NONE, Scalar, Value

_BY_TYPE: dict[type, str] = {
    bool: 'builtins.all builtins.any builtins.bool builtins.callable builtins.issubclass '
    'math.isclose math.isfinite math.isinf math.isnan',
    int: 'builtins.hash builtins.id builtins.int builtins.len builtins.ord math.ceil math.floor '
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

KNOWN_RESULTS: dict[str, Value] = {
    name: Scalar(kind) for kind, names in _BY_TYPE.items() for name in names.split()
}
KNOWN_RESULTS |= {
    **dict.fromkeys(('math.pi', 'math.e', 'math.tau', 'math.inf', 'math.nan'), Scalar(float)),
    'builtins.print': NONE,
    'time.sleep': NONE,
}
