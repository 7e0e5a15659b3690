"""Errors to plant in a system, each with what has to be said of it."""

from collections.abc import Callable
from dataclasses import dataclass

from composer.language.qos import BUILTIN_PROFILES
from tests.fuzz.mutations import misspell
from tests.planted_errors.systems import RANGES
from tests.planted_errors.wiring import OTHER_ENDS, WIRING_ERRORS, find_partners

ENTITIES = ('publishers', 'subscriptions', 'timers', 'services', 'service_clients', 'actions', 'action_clients')  # fmt: skip
CHOICES = ('clock', 'concurrency', 'log_level', 'on_error', 'reliability', 'durability', 'history')


@dataclass
class Planted:
    """An error: the rule that finds it, where, and the right spelling that is suggested for it."""

    kind: str
    rules: tuple
    path: tuple
    meant: str | None = None


def plant(chance, system, count):
    """Plant errors in parts of a system that are not the same; return them."""
    planted, taken = [], set()
    for _ in range(count * 4):
        kind = chance.choice(list(ERRORS))
        place = _choose(chance, system, kind, taken)
        if place is None:
            continue
        involved = _involved(system, place)
        found = ERRORS[kind][1](chance, system, place)
        if found:
            planted.append(Planted(kind, *found))
            # One error in a part, so that none hides another.
            taken |= {place[:4], found[1][:4], *involved}
        if len(planted) == count:
            break
    return planted


def _choose(chance, system, kind, taken):
    places = [
        path
        for path in _paths(system.data)
        if ERRORS[kind][0](path, _at(system, path))
        and not _overlap(taken, {path})
        and not _overlap(taken, _involved(system, path))
    ]
    return chance.choice(places) if places else None


def _overlap(some, others):
    """Return whether a path of some lies within one of the others, or the other way round."""
    return any(
        one[: len(other)] == other or other[: len(one)] == one for one in some for other in others
    )


def _involved(system, path):
    """Return the paths of a part, of its other ends, and of what its payload is held against."""
    ends = {path[:4], *find_partners(system, path)}
    ends |= {
        users
        for section in OTHER_ENDS
        for node, content in system.data['nodes'].items()
        for name in content.get(section, ())
        if path[:4] in find_partners(system, users := ('nodes', node, section, name))
    }
    if is_payload(path, True):
        ends.add((*path[:2], 'publishers', _at(system, (*path[:4], 'publish'))))
    return ends


def _paths(data, path=()):
    for key, value in data.items() if isinstance(data, dict) else ():
        yield (*path, key)
        yield from _paths(value, (*path, key))


def _at(system, path):
    data = system.data
    for key in path:
        data = data[key]
    return data


def _rename(system, path, key):
    parent = _at(system, path[:-1])
    entries = [(key if each == path[-1] else each, value) for each, value in parent.items()]
    parent.clear()
    parent.update(entries)
    return (*path[:-1], key)


def _set(system, path, value):
    _at(system, path[:-1])[path[-1]] = value


def _typo(chance, word, others):
    """Return a misspelt word that is not one of the others, and nearer to it than to any of them."""
    for _ in range(20):
        wrong = misspell(chance, word)
        lowered = {each.lower() for each in others} | {word.lower()}
        if (
            wrong.lower() not in lowered
            and wrong.replace('_', 'a').isalnum()
            and wrong[0].isalpha()
        ):
            return wrong
    return None


def is_entity(path):
    return len(path) == 4 and path[2] in ENTITIES


def is_key(path, _):
    """Whether the language gives the key its name."""
    if path[0] in ('executor', 'defaults') or (path[0] == 'qos' and len(path) == 3):
        return len(path) > 1
    if path[0] != 'nodes' or len(path) not in (3, 5):
        return False
    return len(path) == 3 or path[2] in ENTITIES


def plant_key_typo(chance, system, path):
    wrong = _typo(chance, path[-1], [*KEYS, *_at(system, path[:-1])])
    return wrong and (('unknown-key',), _rename(system, path, wrong), path[-1])


KEYS = ['period', 'rate', 'behaviour', 'with', 'publish', 'message', 'clock', 'group', 'on_error', 'type', 'topic', 'service', 'action', 'qos', 'profile', 'depth', 'history', 'namespace', 'parameters', 'timers', 'publishers', 'services', 'actions', 'threads']  # fmt: skip


def plant_value_typo(chance, system, path):
    value = _at(system, path)
    wrong = _typo(chance, value, ('reject', 'error', 'info', 'warn', 'debug'))
    if wrong is None:
        return None
    _set(system, path, wrong)
    return ('bad-value',), path, value


def plant_dangling_publisher(chance, system, path):
    value = _at(system, path)
    wrong = _typo(chance, value, _at(system, (*path[:2], 'publishers')))
    if wrong is None:
        return None
    _set(system, path, wrong)
    return ('unknown-publisher',), path, value


def plant_dangling_profile(chance, system, path):
    value = _at(system, path)
    wrong = _typo(chance, value, [*system.data.get('qos', ()), *BUILTIN_PROFILES])
    if wrong is None:
        return None
    _set(system, path, wrong)
    return ('unknown-qos-profile',), path, value


def plant_dangling_behaviour(chance, system, path):
    module, _, function = _at(system, path).partition(':')
    if chance.random() < 0.3:
        meant, wrong = module, _typo(chance, module, system.modules)
        value = f'{wrong}:{function}'
    else:
        meant, wrong = function, _typo(chance, function, system.modules[module])
        value = f'{module}:{wrong}'
    if wrong is None:
        return None
    _set(system, path, value)
    return ('unknown-behaviour',), path, meant


def plant_dangling_type(chance, system, path):
    package, kind, name = _at(system, path).split('/')
    part = chance.randrange(3)
    if part == 0 and (wrong := _typo(chance, package, ())):
        _set(system, path, f'{wrong}/{kind}/{name}')
        return ('unknown-type',), path, package
    if part == 1 and (wrong := _typo(chance, name, ())):
        _set(system, path, f'{package}/{kind}/{wrong}')
        return ('unknown-type',), path, name
    value = chance.choice((f'{package}/{name}', f'{package}/{misspell(chance, kind)}/{name}', 7))
    if value == f'{package}/{kind}/{name}' or (isinstance(value, str) and ' ' in value):
        return None
    _set(system, path, value)
    return ('bad-value', 'wrong-type'), path, None


def plant_argument_typo(chance, system, path):
    if path[-1] not in _function(system, path[:-2]).keywords:
        return None
    wrong = _typo(chance, path[-1], _at(system, path[:-1]))
    return wrong and (('bad-argument',), _rename(system, path, wrong), path[-1])


def _function(system, entity):
    module, _, name = _at(system, (*entity, 'behaviour')).partition(':')
    return system.modules[module][name]


WRONG_VALUES = {
    'period': ('fast', -1, 0, [1], None, True, '1 s'),
    'rate': ('fast', -5, 0, {}, None),
    'threads': ('many', 0, -1, 2.5, 10_000),
    'depth': (0, 'ten', -3, 1.5),
    'use_sim_time': ('yes', 1, 'on', None),
    'shutdown_timeout': (-1, 'long'),
    'deadline': (-1, 'never', 0, [1]),
    'parameters': ([1], 3, 'x', None),
    'timers': ([1], 3, None),
    'with': ([1], 'x', 3),
    'topic': (3, ['a'], None, {}),
    'group': (3, '', None),
    'on_start': (3, [], None, 'no behaviour'),
    'behaviour': (3, 'without_a_colon', 'a:b:c', 'mod.ule', None),
    'namespace': (3, None, [1]),
}


def plant_wrong_type(chance, system, path):
    _set(system, path, chance.choice(WRONG_VALUES[path[-1]]))
    return ('wrong-type', 'out-of-range', 'bad-value'), path


def plant_missing_key(chance, system, path):
    entity = _at(system, path)
    key = chance.choice(
        [each for each in ('type', 'behaviour', 'period', 'rate') if each in entity]
    )
    if key == 'behaviour' and 'publish' in entity and path[2] == 'subscriptions':
        return None
    del entity[key]
    return ('missing-key',), path


def plant_conflict(chance, system, path):
    entity = _at(system, path)
    other = 'rate' if 'period' in entity else 'period'
    entity[other] = 3
    return ('conflicting-keys',), (*path, other)


def plant_bad_parameter(chance, system, path):
    value = _at(system, path)
    default = (*path, 'default')
    if 'choices' in value:
        _set(system, default, chance.choice(('slowly', 7)))
    elif 'minimum' in value and chance.random() < 0.3 and 'step' not in value:
        value['maximum'] = value['minimum'] - 1
        return ('bad-parameter',), (*path, 'maximum')
    elif 'step' in value:
        _set(system, default, value['minimum'] + 3)
    elif 'minimum' in value:
        _set(system, default, chance.choice((value['maximum'] + 1, value['minimum'] - 9, 'much')))
    elif value.get('type') == 'double':
        _set(system, default, chance.choice(('half', True)))
    elif value.get('type') == 'integer_array' and 'default' in value:
        _set(system, default, chance.choice((3, 'x')))
    else:
        value['type'], value['default'] = 'string', 5
    return ('bad-parameter',), default


def _fields(system, path):
    """Yield the places of a payload, with the type of each."""
    entity = path[:4]
    publisher = _at(system, (*entity, 'publish'))
    kind = _at(system, (*path[:2], 'publishers', publisher, 'type'))
    pending = [(path, system.catalogue.describe(kind))]
    while pending:
        at, description = pending.pop()
        for key, value in _at(system, at).items():
            field = description.field(key).type
            yield (*at, key), field, description
            if isinstance(value, dict):
                pending.append(((*at, key), system.catalogue.describe(field.nested)))


def plant_field_typo(chance, system, path):
    at, _, description = chance.choice(list(_fields(system, path)))
    names = [each.name for each in description.fields]
    wrong = _typo(chance, at[-1], names) if len(at[-1]) > 1 else None
    return wrong and (('unknown-field',), _rename(system, at, wrong), at[-1])


def plant_field_value(chance, system, path):
    at, kind, _ = chance.choice(list(_fields(system, path)))
    value = _at(system, at)
    if kind.array == 'fixed' and chance.random() < 0.5:
        value.append(value[0])
        return ('field-length',), at
    if kind.array:
        if value and chance.random() < 0.5:
            value[-1] = [[]]
            return ('field-type',), (*at, len(value) - 1)
        _set(system, at, chance.choice((3, 'text')))
    elif kind.kind in RANGES:
        low, high = RANGES[kind.kind]
        wrong = chance.choice((low - 1, high + 1, 'three', 1.5, True, None, [1]))
        _set(system, at, wrong)
    elif kind.nested:
        _set(system, at, chance.choice((3, [1], 'text')))
        if len(system.catalogue.describe(kind.nested).fields) == 1:
            # A bare value may be that of the one field.
            _set(system, at, value)
            return None
    else:
        wrong = {'bool': ('yes', 1), 'string': (5, True, [1])}.get(
            kind.kind, ('fast', True, [1.0])
        )
        _set(system, at, chance.choice(wrong))
    return ('field-type', 'field-range'), at


def plant_signature(chance, system, path):
    module, _, name = _at(system, path).partition(':')
    function = system.modules[module][name]
    if function.bound != 1:
        return None
    function.parameters = chance.choice(
        ([], [*function.parameters, 'extra'], function.parameters[:-1])
    )
    return ('bad-signature',), path


def plant_generator(chance, system, path):
    module, _, name = _at(system, path).partition(':')
    function = system.modules[module][name]
    if path[2] not in ('subscriptions', 'services', 'action_clients') or function.bound != 1:
        return None
    function.body = [chance.choice(('yield 1', 'x = yield', 'yield from []'))]
    return ('generator-not-allowed',), path


def plant_constant(chance, system, path):
    module, _, name = _at(system, path).partition(':')
    system.modules[module][name] = chance.choice(('5', '"text"', 'None'))
    return ('uncallable-behaviour',), path


def plant_duplicate(chance, system, path):
    system.twice.add(path)
    return ('duplicate-key',), path


def plant_bad_name(chance, system, path):
    if len(path) == 2:
        return ('bad-name',), _rename(
            system, path, chance.choice(('1st', 'a-b', 'a b', 'ä', 'a.b'))
        )
    if path[-1] in ('topic', 'service', 'action'):
        wrong = chance.choice(('a//b', 'a b', 'a-b', '/1a', 'a/', 'a~', '/a/{x}', '', '~a'))
        _set(system, path, wrong)
        return ('bad-name',), path
    return ('bad-name',), _rename(system, path, chance.choice(('a..b', 'a b', '.a')))


def is_payload(path, value):
    return len(path) == 5 and path[2] == 'timers' and path[4] == 'message' and value


def is_behaviour(path, value):
    return path[0] == 'nodes' and path[-1] in ('behaviour', 'result') and isinstance(value, str)


ERRORS: dict[str, tuple[Callable, Callable]] = {
    'key typo': (is_key, plant_key_typo),
    'value typo': (lambda path, _: path[-1] in CHOICES, plant_value_typo),
    'dangling publisher': (lambda path, _: path[-1] == 'publish', plant_dangling_publisher),
    'dangling profile': (
        lambda path, value: len(path) == 5 and path[-1] == 'qos' and isinstance(value, str),
        plant_dangling_profile,
    ),
    'dangling behaviour': (is_behaviour, plant_dangling_behaviour),
    'dangling type': (
        lambda path, _: len(path) == 5 and path[-1] == 'type' and path[2] in ENTITIES,
        plant_dangling_type,
    ),
    'argument typo': (lambda path, _: path[-2:-1] == ('with',), plant_argument_typo),
    'wrong type': (
        lambda path, value: path[-1] in WRONG_VALUES and is_key(path, value),
        plant_wrong_type,
    ),
    'missing key': (lambda path, _: is_entity(path), plant_missing_key),
    'conflicting keys': (
        lambda path, _: is_entity(path) and path[2] == 'timers',
        plant_conflict,
    ),
    'bad parameter': (
        lambda path, value: path[2:3] == ('parameters',) and len(path) == 4 and isinstance(value, dict),
        plant_bad_parameter,
    ),
    'field typo': (is_payload, plant_field_typo),
    'field value': (is_payload, plant_field_value),
    'signature': (is_behaviour, plant_signature),
    'generator': (is_behaviour, plant_generator),
    'constant': (is_behaviour, plant_constant),
    **WIRING_ERRORS,
    'duplicate key': (lambda path, _: is_entity(path), plant_duplicate),
    'bad name': (
        lambda path, _: (
            (path[0] == 'nodes' and len(path) == 2)
            or (len(path) == 5 and path[-1] in ('topic', 'service', 'action'))
            or (len(path) == 4 and path[2] == 'parameters')
        ),
        plant_bad_name,
    ),
}  # fmt: skip
