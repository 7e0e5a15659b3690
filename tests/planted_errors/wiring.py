"""Errors between parts: what each takes is fine, and together they are not."""

from tests.fuzz.mutations import misspell

# What asks for more than any publisher of a made system offers.
DEMANDS = {
    'deadline': 0.1,
    'liveliness': 'manual_by_topic',
    'liveliness_lease_duration': 0.5,
}
# What is asked for, and what does not offer it.
PAIRS = {
    'reliability': ('reliable', 'best_effort'),
    'durability': ('transient_local', 'volatile'),
}
OTHER_TYPES = {
    'subscriptions': 'std_msgs/msg/Byte',
    'service_clients': 'nav_msgs/srv/GetMap',
    'action_clients': 'test_msgs/action/NestedMessage',
}
# Where the other ends of a section are, and the key that both are called by.
OTHER_ENDS = {
    'subscriptions': ('publishers', 'topic'),
    'service_clients': ('services', 'service'),
    'action_clients': ('actions', 'action'),
}


def find_partners(system, path):
    """Return the paths of the other ends of a subscription or a client."""
    section, key = OTHER_ENDS.get(path[2] if len(path) > 2 else None, (None, None))
    if section is None or len(path) < 4:
        return []
    nodes = system.data['nodes']
    name = nodes[path[1]][path[2]][path[3]].get(key)
    return [
        ('nodes', node, section, entity)
        for node, content in nodes.items()
        for entity, ends in content.get(section, {}).items()
        if isinstance(ends, dict) and ends.get(key) == name
    ]


def _entity(system, path):
    return system.data['nodes'][path[1]][path[2]][path[3]]


def plant_qos_conflict(chance, system, path):
    """Let a subscription ask for what its publisher does not offer, sometimes by a profile."""
    end = _entity(system, path)
    (partner,) = find_partners(system, path)
    policy = chance.choice((*DEMANDS, *PAIRS))
    if policy in PAIRS:
        asked, offered = PAIRS[policy]
        _entity(system, partner)['qos'] = {policy: offered, 'depth': 2}
    else:
        asked = DEMANDS[policy]
    end['qos'] = {policy: asked}
    if chance.random() < 0.3 and 'qos' in system.data:
        name = f'asking_{path[3]}'
        system.data['qos'][name] = end['qos']
        end['qos'] = name
        return ('incompatible-qos',), (*path, 'qos')
    return ('incompatible-qos',), (*path, 'qos', policy)


def plant_remapped_qos_conflict(chance, system, path):
    """Let it ask so under a name that a rule of its node makes the publisher's."""
    node = system.data['nodes'][path[1]]
    if 'remap' in node:
        return None
    planted = plant_qos_conflict(chance, system, path)
    end = _entity(system, path)
    node['remap'] = {'remapped_name': end['topic']}
    end['topic'] = 'remapped_name'
    return planted


def plant_other_type(_, system, path):
    """Give one end another type; of two, the publisher or server is believed."""
    end = _entity(system, path)
    if end['type'] == OTHER_TYPES[path[2]] or not find_partners(system, path):
        return None
    end['type'] = OTHER_TYPES[path[2]]
    return ('conflicting-types',), (*path, 'type')


def plant_second_server(chance, system, path):
    """Let another node serve the same."""
    others = [node for node in system.data['nodes'] if node != path[1]]
    order = list(system.data['nodes'])
    later = [node for node in others if order.index(node) > order.index(path[1])]
    if not later:
        return None
    node, name = chance.choice(later), f'second_{path[3]}'
    module, _, function = _entity(system, path)['behaviour'].partition(':')
    system.modules[module][function].bound += 1
    system.data['nodes'][node].setdefault(path[2], {})[name] = dict(_entity(system, path))
    return ('second-server',), ('nodes', node, path[2], name)


def plant_lonely_end(chance, system, path):
    """Misspell the name by which an end would meet the other one."""
    key = OTHER_ENDS[path[2]][1]
    end = _entity(system, path)
    if not find_partners(system, path):
        return None
    meant, wrong = end[key], '/' + misspell(chance, end[key][1:])
    if wrong.lower() == meant.lower() or not wrong[1:].replace('_', 'a').isalnum():
        return None
    if not (wrong[1].isalpha() and wrong.isascii()):
        return None
    end[key] = wrong
    return ('no-publisher', 'no-server'), (*path, key), meant


def plant_relay_loop(_, system, path):
    """Let a node pass on what it publishes itself."""
    node = system.data['nodes'][path[1]]
    publisher, name = f'loop_{path[3]}', f'looping_{path[3]}'
    node['publishers'][publisher] = {'type': 'std_msgs/msg/String', 'topic': f'/{publisher}'}
    node.setdefault('subscriptions', {})[name] = {
        'type': 'std_msgs/msg/String',
        'topic': f'/{publisher}',
        'publish': publisher,
    }
    return ('relay-loop',), ('nodes', path[1], 'subscriptions', name, 'publish')


def plant_deadlock(chance, system, path):
    """Let a service wait for itself: directly, by a constant name, or in a function inside."""
    served = _entity(system, path)
    module, _, name = served['behaviour'].partition(':')
    function, client = system.modules[module][name], f'own_{path[3]}'
    if function.bound != 1 or function.body:
        return None
    node = system.data['nodes'][path[1]]
    node.setdefault('service_clients', {})[client] = {
        'type': served['type'],
        'service': served['service'],
    }
    function.body = chance.choice(
        (
            [f'return node.call({client!r}, None)'],
            [f'name = {client!r}', 'return node.call(name, None)'],
            ['def ask():', f'    return node.call({client!r}, None)', 'return ask()'],
        )
    )
    return ('service-deadlock',), (*path, 'behaviour')


def plant_wait_cycle(chance, system, path):
    """Let two nodes wait for each other."""
    nodes = system.data['nodes']
    others = [node for node in nodes if node != path[1] and 'wait_for' not in nodes[node]]
    if not others or 'wait_for' in nodes[path[1]]:
        return None
    other = chance.choice(others)
    places = {name: _full_name(system, name) for name in (path[1], other)}
    nodes[path[1]]['wait_for'] = {'node': places[other]}
    nodes[other]['wait_for'] = {'node': places[path[1]]}
    last = max(path[1], other, key=list(nodes).index)
    return ('wait-cycle',), ('nodes', last, 'wait_for', 'node')


def plant_wait_typo(chance, system, path):
    """Let a node wait for one whose name is misspelt."""
    nodes = system.data['nodes']
    others = [node for node in nodes if node != path[1]]
    if not others or 'wait_for' in nodes[path[1]]:
        return None
    meant = _full_name(system, chance.choice(others))
    head, _, word = meant.rpartition('_')
    if len(word) < 5:
        return None
    # One letter is another, so that it is no other word.
    wrong = f'{head}_{word[:2]}q{word[3:]}'
    nodes[path[1]]['wait_for'] = {'node': wrong, 'timeout': 5}
    return ('likely-misspelling',), ('nodes', path[1], 'wait_for', 'node'), meant


def _full_name(system, node):
    default = system.data.get('defaults', {}).get('namespace', '')
    namespace = system.data['nodes'][node].get('namespace', default)
    within = namespace if namespace.startswith('/') or not namespace else f'{default}/{namespace}'
    return f'{within}/{node}'


def is_user(path, value):
    return len(path) == 4 and path[2] in OTHER_ENDS and isinstance(value, dict)


def is_served(path, _):
    return len(path) == 4 and path[2] in ('services', 'actions')


WIRING_ERRORS = {
    'qos conflict': (
        lambda path, value: is_user(path, value) and path[2] == 'subscriptions',
        plant_qos_conflict,
    ),
    'remapped qos conflict': (
        lambda path, value: is_user(path, value) and path[2] == 'subscriptions',
        plant_remapped_qos_conflict,
    ),
    'other type': (is_user, plant_other_type),
    'second server': (is_served, plant_second_server),
    'lonely end': (is_user, plant_lonely_end),
    'relay loop': (lambda path, _: path[2:3] == ('publishers',) and len(path) == 4, plant_relay_loop),
    'deadlock': (lambda path, _: path[2:3] == ('services',) and len(path) == 4, plant_deadlock),
    'wait cycle': (lambda path, _: path[0] == 'nodes' and len(path) == 2, plant_wait_cycle),
    'wait typo': (lambda path, _: path[0] == 'nodes' and len(path) == 2, plant_wait_typo),
}  # fmt: skip
