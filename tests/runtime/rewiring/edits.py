"""Random edits of a system's files: of each key of the schema, and of the modules."""

import copy
import json
import random
import re

from tests.runtime.rewiring.base_system import (
    DOCUMENTS,
    MODULES,
    PARAMETERS,
    PROGRAM,
    SHARE,
    SYSTEM,
    WITNESS_NODES,
)
from tests.runtime.rewiring.edit_values import NULL, VALUES
from tests.runtime.rewiring.schema_keys import ANY, read_schema_keys

# Of what the file may say in short: the key that it is short for.
_LONG_FORMS = {
    'args': 'default',
    'parameters': 'default',
    'publishers': 'type',
    'service_clients': 'type',
    'action_clients': 'type',
    'on_start': 'behaviour',
    'on_stop': 'behaviour',
    'on_parameters': 'behaviour',
    'diagnostics': None,
    'qos': None,
}
_SECTIONS = ('parameters', 'publishers', 'subscriptions', 'timers', 'services', 'service_clients')
_SECTIONS = (*_SECTIONS, 'actions', 'action_clients')
_LINES = (
    *('# {}', 'LEVEL_{} = 1', 'class Level{}:\n    pass', 'import nothing_{}', 'def broken_{}(:'),
    *(
        '1 / 0',
        'import helper\nassert helper.WORD == {}',
        'raise SystemExit({})',
        'from . import x',
    ),
)
_RENAMES = (('def tick(', 'def tock('), ('def hear(', 'def haer('), ('node, text=', 'node, txt='))
_LIMITS = ('5', '8', '1.5', 'many', '[1', '[1, 2]', '5\n    use_sim_time: true')
_LIMITS = (*_LIMITS, '8\n    start_type_description_service: true')


class Project:
    """The files of a system, and edits of them that a seed decides.

    Attributes:
        path: The system's file.
        edited: The keys of the schema that edits have given a value.
    """

    def __init__(self, folder, seed):
        self._folder = folder
        self._random = random.Random(seed)
        self._places = read_schema_keys()
        self._documents = copy.deepcopy(DOCUMENTS)
        self._texts = dict(MODULES)
        self._texts['parameters.yaml'] = PARAMETERS.format(limit=7)
        self._texts['others.yaml'] = 'talker:\n  ros__parameters:\n    name: Carol\n'
        self._texts[SHARE] = ''
        self._texts[PROGRAM] = '#!/bin/sh\nexec sleep 1000\n'
        self._number = 0
        self._valid = None
        self.edited = set()

    @property
    def path(self):
        return self._folder / 'system.yaml'

    @property
    def paths(self):
        """The system's file and its layer."""
        return [self.path, self._folder / 'layer.yaml']

    def edit(self):
        """Make one to three edits; return what they are."""
        times = self._random.choice([1, 1, 1, 2, 2, 3])
        return [self._edit() for _ in range(times)]

    def keep(self):
        """Remember the files as they are: they are valid."""
        self._valid = copy.deepcopy((self._documents, self._texts))

    def go_back(self):
        """Make the files what they were when they were valid."""
        self._documents, self._texts = copy.deepcopy(self._valid)

    def write(self):
        """Write all files."""
        for name, data in self._documents.items():
            # JSON is YAML.
            (self._folder / name).write_text(json.dumps(data, indent=1))
        for name, text in self._texts.items():
            path = self._folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if text is None:
                path.unlink(missing_ok=True)
            else:
                path.write_text(text)
        (self._folder / PROGRAM).chmod(0o755)

    def set_key(self, key, value):
        """Give a key a value at one of its places; return where, `None` for nowhere."""
        document = self._random.choice(['system.yaml'] * 8 + ['part.yaml', 'part.yaml'])
        data = self._documents[document]
        owners = [
            (*found, place[-1])
            for place in self._places[key]
            for found in _find(data, place[:-1], ())
            if not WITNESS_NODES.keys() & {*found}
        ]
        if not owners:
            return None
        *owner, last = self._random.choice(owners)
        _set(data, owner, last, copy.deepcopy(value))
        self._documents['system.yaml'].setdefault('nodes', {}).update(WITNESS_NODES)
        self.edited.add(key)
        return f'{document}: {".".join(map(str, [*owner, last]))} = {value!r}'

    def _edit(self):
        """Make one edit; return what it is."""
        modules = [self._edit_module] * 4
        rest = [self._edit_layer, self._edit_limit, self._add_or_remove, self._rename, self._reset]
        edits = [*[self._edit_key] * 15, *modules, *[self._move] * 4, *rest]
        while (done := self._random.choice(edits)()) is None:
            pass
        return done

    def _edit_key(self):
        key = self._random.choice(sorted(VALUES))
        value = self._random.choice(VALUES[key])
        return self.set_key(key, value)

    def _edit_module(self):
        name = self._random.choice(sorted(MODULES))
        self._number += 1
        text = self._texts[name]
        what = self._random.random()
        if text is None or what < 0.05:
            self._texts[name] = MODULES[name] if text is None else None
            return f'{name}: comes or goes'
        if what < 0.6:
            self._texts[name] = re.sub(r'(?<=TAG = )\d+', str(self._number), text, count=1)
            return f'{name}: TAG = {self._number}'
        if what < 0.7:
            self._texts[name] = re.sub("(?<=WORD = ')w.*?(?=')", f'w{self._number}', text)
            return f'{name}: WORD = w{self._number}'
        if what < 0.8:
            old, new = self._random.choice(_RENAMES)
            self._texts[name] = text.replace(old, new)
            return f'{name}: {old} -> {new}'
        line = self._random.choice(_LINES).format(self._number)
        self._texts[name] = f'{text}\n\n{line}\n'
        return f'{name}: {line}'

    def _edit_layer(self):
        layer = self._documents['layer.yaml'] = copy.deepcopy(DOCUMENTS['layer.yaml'])
        nodes = self._documents['system.yaml']['nodes']
        node = self._random.choice(sorted(nodes.keys() - WITNESS_NODES.keys()) or ['nobody'])
        key = self._random.choice(sorted(each for each in VALUES if each.startswith('node.')))
        value = self._random.choice(VALUES[key])
        layer['nodes'][node] = {key.partition('.')[2]: None if value == NULL else value}
        if self._random.random() < 0.5:
            layer['nodes'] = {}
        return f'layer.yaml: {layer["nodes"]}'

    def _edit_limit(self):
        limit = self._random.choice(_LIMITS)
        self._texts['parameters.yaml'] = PARAMETERS.format(limit=limit)
        return f'parameters.yaml: {limit}'

    def _add_or_remove(self):
        nodes = self._documents['system.yaml']['nodes']
        node = self._random.choice(sorted(nodes))
        entries = nodes[node]
        section = self._random.choice(_SECTIONS)
        mine = entries.get(section)
        if node in WITNESS_NODES or (mine is not None and not isinstance(mine, dict)):
            return None
        if mine and self._random.random() < 0.5:
            name = self._random.choice(sorted(mine))
            del mine[name]
            return f'no {node}.{section}.{name}'
        origins = [each for each in SYSTEM['nodes'] if section in SYSTEM['nodes'][each]]
        origin = self._random.choice(sorted(set(origins) - WITNESS_NODES.keys()))
        name = self._random.choice(sorted(SYSTEM['nodes'][origin][section]))
        entry = copy.deepcopy(SYSTEM['nodes'][origin][section][name])
        entries.setdefault(section, {})[name] = entry
        return f'{node}.{section}.{name} as of {origin}'

    def _rename(self):
        nodes = self._documents['system.yaml']['nodes']
        node = self._random.choice(sorted(nodes.keys() - WITNESS_NODES.keys()) or ['nobody'])
        name = self._random.choice(['talker', 'listener', 'user', 'fourth', '/full/fifth'])
        if self._random.random() < 0.4:
            nodes.pop(node, None)
            return f'no node {node}'
        origin = self._random.choice([SYSTEM['nodes'], nodes])
        node = node if node in origin else 'talker'
        nodes[name] = copy.deepcopy(origin.get(node, {}))
        return f'node {name} as {node}'

    def _move(self):
        if self._random.random() < 0.3:
            keys = sorted(each for each in VALUES if each.startswith('worker'))
            key = self._random.choice(keys)
        else:
            key = self._random.choice(['node.worker'] * 4 + ['include.worker', 'defaults.worker'])
        return self.set_key(key, self._random.choice(VALUES[key]))

    def _reset(self):
        self._documents = copy.deepcopy(DOCUMENTS)
        self._texts |= MODULES
        self._texts['parameters.yaml'] = PARAMETERS.format(limit=7)
        return 'all as at first'


def _find(value, place, found):
    """Yield the paths that a place stands for; what may be there and is not counts, too."""
    if not place:
        yield found
        return
    first, *rest = place
    if first != ANY:
        inner = value.get(first) if isinstance(value, dict) else None
        yield from _find(inner, rest, (*found, first))
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from _find(inner, rest, (*found, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _find(inner, rest, (*found, index))


def _set(data, owner, last, value):
    """Set or remove a key at a path; what stands in its way becomes its long form."""
    at = data
    for index, key in enumerate(owner):
        if isinstance(at, list) and not isinstance(key, int):
            return
        inner = at[key] if isinstance(at, list) else at.get(key)
        if not isinstance(inner, dict | list):
            names = [_LONG_FORMS[each] for each in owner[: index + 1] if each in _LONG_FORMS]
            inner = at[key] = {names[-1]: inner} if names and names[-1] and inner else {}
        at = inner
    if not isinstance(at, dict):
        return
    if value is None:
        at.pop(last, None)
    else:
        at[last] = None if value == NULL else value
