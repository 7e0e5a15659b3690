"""The QoS of many ends of one topic or service, against the comparison of each with each."""

from itertools import product
from random import Random

import pytest

from composer.checks.checker import create_context
from composer.checks.connections import qos
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text
from composer.language.qos import (
    BEST_OF_PUBLISHERS,
    BEST_OF_SERVICES,
    resolve_qos,
    settle_best_available,
)
from composer.language.qos_conflicts import find_qos_conflicts

CHOICES = {
    'reliability': ['reliable', 'best_effort', 'best_available'],
    'durability': ['volatile', 'transient_local'],
    'liveliness': ['automatic', 'manual_by_topic'],
    'deadline': ['infinite', 1, 2],
    'depth': [1, 2, 3],
    'lifespan': ['infinite', 1],
}


def some_qos(rng):
    """Return a QoS that has few policies, as most are, or none."""
    names = rng.sample(sorted(CHOICES), rng.choice([0, 1, 1, 2, 4]))
    return {name: rng.choice(CHOICES[name]) for name in names}


def entity(sections, channel, qos_data):
    type_name = {'topic': 'std_msgs/msg/String', 'service': 'std_srvs/srv/Trigger'}[channel]
    behaviour = '' if sections in ('publishers', 'service_clients') else 'behaviour: parts:do, '
    policies = ', '.join(f'{name}: {value}' for name, value in qos_data.items())
    return f'{sections}: {{it: {{{channel}: /it, type: {type_name}, {behaviour}qos: {{{policies}}}}}}}'


def context_of(channel, provided, used):
    sections = {
        'topic': ('publishers', 'subscriptions'),
        'service': ('services', 'service_clients'),
    }
    nodes = [
        f'  {letter}{index}: {{{entity(section, channel, data)}}}\n'
        for section, letter, group in zip(sections[channel], 'pu', (provided, used), strict=True)
        for index, data in enumerate(group)
    ]
    system = load_system_text(f'version: 1\nnodes:\n{"".join(nodes)}')
    return create_context(system, InterfaceCatalogue(prefixes=[]))


def firsts(ends):
    """Return the first end of each QoS, with its policies."""
    found = {}
    for end in ends:
        policies = resolve_qos(end.qos, {})
        found.setdefault(tuple(sorted(policies.items())), (str(end), policies))
    return found.values()


def conflicts_of(channel, provided, used):
    if channel == 'topic':
        offered = settle_best_available(provided, BEST_OF_PUBLISHERS)
        return list(find_qos_conflicts(offered, used))
    server, client = (settle_best_available(each, BEST_OF_SERVICES) for each in (provided, used))
    return [*find_qos_conflicts(server, client), *find_qos_conflicts(client, server)]


@pytest.mark.parametrize('channel', ['topic', 'service'])
@pytest.mark.parametrize('seed', range(20))
def test_each_pair_of_different_qos_that_never_matches_is_a_finding_in_order(channel, seed):
    rng = Random(seed)
    groups = [[some_qos(rng) for _ in range(rng.randint(0, 9))] for _ in range(2)]
    context = context_of(channel, *groups)
    found = [each.message for each in qos.check_qos_pairs(context)]
    (one,) = context.topology.of_kind(channel) if any(groups) else [None]
    expected = [
        f"on {channel} '/it' the QoS of {provider} and of {user} never match: "
        + '; '.join(map(str, conflicts))
        for (provider, here), (user, there) in (
            product(firsts(one.providers), firsts(one.users)) if one else ()
        )
        if (conflicts := conflicts_of(channel, here, there))
    ]
    assert found == expected
