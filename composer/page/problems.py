"""What is wrong in a running system, the worst first, each with the part that it is about."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_ORDER = {'error': 0, 'stale': 1, 'warn': 2, 'warning': 2}
_MS_PER_SEC = 1000


def list_problems(
    status: dict[str, Any],
    health: dict[str, Any],
    outside: Mapping[str, list[dict[str, str]]],
    topics: Mapping[str, str],
) -> list[dict[str, str]]:
    """Return problems as the page lists them: `level`, `text` and `node`, which may be empty.

    Args:
        outside: See `find_outside`.
        topics: The topic of each publisher and subscription, by its kind, node and name.
    """
    found = [*_of_system(status, health, outside), *_of_entities(health, topics)]
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
    for node in status.get('stopped', ()):
        yield _problem('warn', f'{node} was stopped', node)
    for node, state in status.get('lifecycles', {}).items():
        if state != 'active':
            yield _problem('warn', f'{node} is {state}, and not active', node)
    for process in health.get('external_processes', ()):
        if process['level'] != 'ok':
            yield _problem(process['level'], f"process '{process['name']}': {process['message']}")
        elif process['restarts']:
            times = f'{process["restarts"]} times'
            yield _problem('warn', f"process '{process['name']}' was restarted {times}")
    for end in chain(*outside.values()):
        if 'problem' in end:
            yield _problem('warn', end['problem'], end['problem_at'])


def _of_entities(health: dict[str, Any], topics: Mapping[str, str]) -> Iterator[dict[str, str]]:
    rows = health.get('entities', ())
    publishers = [row for row in rows if row['kind'] == 'publisher' and row['rate_hz']]
    for row in rows:
        name = f'{row["kind"]} {row["name"]} of {row["node"]}'
        level = str(row.get('level', 'ok'))
        drops = f'{row["dropped"]:g} messages dropped' if row['dropped'] else ''
        text = f'{row["errors"]:g} errors since the start' if row['errors'] else drops
        text = row.get('message', level) if level != 'ok' else text
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
