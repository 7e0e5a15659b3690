"""What is wrong in a running system, and the ends outside of it that it may not match."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

from composer.names import join_names

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

_ORDER = {'error': 0, 'stale': 1, 'warn': 2, 'warning': 2}
_MS_PER_SEC = 1000
# It may begin within the period.
_FEW_TICKS = 3
_MOST_ENDS = 50
_LONGEST_NAME = 200
# Composer's own tools, as the page itself; and an end may be known before its node is.
_UNSHOWN = ('_composer_client_', '_NODE_NAME_UNKNOWN_')


def list_problems(
    status: dict[str, Any],
    health: dict[str, Any],
    outside: Mapping[str, list[dict[str, str]]],
    topics: Mapping[str, str],
    rates: Mapping[str, float],
) -> list[dict[str, str]]:
    """Return problems as the page lists them: `level`, `text` and `node`, which may be empty.

    Args:
        outside: See `find_outside`.
        topics: The topic of each publisher and subscription, by its kind, node and name.
        rates: How often a timer is to be called, in Hz, likewise.
    """
    states = status.get('lifecycles', {}).items()
    resting = {
        *status.get('stopped', ()),
        *status.get('awaited', ()),
        *(node for node, state in states if state != 'active'),
    }
    awake = {key: rate for key, rate in rates.items() if key.split(':')[1] not in resting}
    found = [*_of_system(status, health, outside), *_of_entities(health, topics, awake)]
    return sorted(found, key=lambda each: _ORDER.get(each['level'], 3))


def _problem(level: str, text: str, node: str = '') -> dict[str, str]:
    return {'level': level, 'text': text, 'node': node}


def _of_system(
    status: dict[str, Any],
    health: dict[str, Any],
    outside: Mapping[str, list[dict[str, str]]],
) -> Iterator[dict[str, str]]:
    if status.get('last_error'):
        yield _problem('error', f'the last reload failed: {status["last_error"]}')
    states = status.get('lifecycles', {}).items()
    told = [
        *((node, 'was stopped') for node in status.get('stopped', ())),
        *((who, f'waits for {what}') for who, what in status.get('awaited', {}).items()),
        *((node, f'is {state}, and not active') for node, state in states if state != 'active'),
    ]
    for who, what in told:
        yield _problem('warn', f'{who} {what}', who if who.startswith('/') else '')
    for process in health.get('external_processes', ()):
        if process['level'] != 'ok':
            yield _problem(process['level'], f"process '{process['name']}': {process['message']}")
        elif process['restarts']:
            times = f'{process["restarts"]} times'
            yield _problem('warn', f"process '{process['name']}' was restarted {times}")
    for end in chain(*outside.values()):
        if 'problem' in end:
            yield _problem('warn', end['problem'], end['problem_at'])


def _of_entities(
    health: dict[str, Any], topics: Mapping[str, str], rates: Mapping[str, float]
) -> Iterator[dict[str, str]]:
    rows = health.get('entities', ())
    publishers = [row for row in rows if row['kind'] == 'publisher' and row['rate_hz']]
    for row in rows:
        name = f'{row["kind"]} {row["name"]} of {row["node"]}'
        level = str(row.get('level', 'ok'))
        drops = f'{row["dropped"]:g} messages dropped' if row['dropped'] else ''
        text = f'{row["errors"]:g} errors since the start' if row['errors'] else drops
        text = row.get('message', level) if level != 'ok' else text
        rate_hz = rates.get(_key(row), 0.0)
        if not text and row['rate_hz'] == 0 and rate_hz * health['period_sec'] >= _FEW_TICKS:
            text = f'0/s, where {rate_hz:.3g}/s are declared'
        if drops and (topic := topics.get(_key(row))):
            sent = [each for each in publishers if topics.get(_key(each)) == topic]
            text += ''.join(f'; {each["node"]} publishes {each["rate_hz"]:.3g}/s' for each in sent)
            # Else something else keeps it waiting.
            if sum(each['rate_hz'] for each in sent) * (row['mean_ms'] or 0.0) > _MS_PER_SEC:
                text += f', and each takes {row["mean_ms"]:.3g} ms'
        if text:
            yield _problem('warn' if level == 'ok' else level, f'{name}: {text}', row['node'])


def _key(row: dict[str, Any]) -> str:
    """Return what `Edge` has as its id."""
    return f'{row["kind"]}:{row["node"]}:{row["name"]}'


def find_outside(
    node: Any, topics: Iterable[str], own: Collection[str]
) -> dict[str, list[dict[str, str]]]:
    """Return the ends outside of a system, by the full names of topics.

    Each has `kind`, `node` and `type`; where no message can go, `problem`, and the node of the
    system that has it, `problem_at`.

    Args:
        node: A node of rclpy.
        own: The full names of the system's nodes.
    """
    outside = {}
    for topic in topics:
        ends = [
            (join_names(end.node_namespace, end.node_name), end)
            for end in (
                *node.get_publishers_info_by_topic(topic),
                *node.get_subscriptions_info_by_topic(topic),
            )
        ]
        ends_here = [each for each in ends if each[0] in own]
        listed = [
            {
                'kind': end.endpoint_type.name.lower(),
                'node': name[:_LONGEST_NAME],
                'type': end.topic_type[:_LONGEST_NAME],
                **_find_problem(topic, name, end, ends_here),
            }
            for name, end in ends
            if name not in own and not end.node_name.startswith(_UNSHOWN)
        ]
        if listed:
            listed.sort(key=lambda end: (end['kind'], end['node'], end['type']))
            outside[topic] = listed[:_MOST_ENDS]
    return outside


def _find_problem(
    topic: str, name: str, end: Any, ends_here: Iterable[tuple[str, Any]]
) -> dict[str, str]:
    """Return why no message goes between an end outside and one of the system, and which."""
    from composer.runtime.health.unmatched import find_mismatch
    from composer.runtime.messages.qos_profiles import read_policies

    for node, here in ends_here:
        if here.endpoint_type == end.endpoint_type:
            continue
        publishes = here.endpoint_type.name == 'PUBLISHER'
        policies = read_policies(here.qos_profile)
        if reason := find_mismatch(end, here.topic_type, policies, publishes=publishes):
            what = 'sends nothing to' if publishes else 'gets nothing from'
            return {'problem': f'{topic} of {node} {what} {name}: {reason}', 'problem_at': node}
    return {}
