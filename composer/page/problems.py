"""What is wrong in a running system, the worst first, each with the part that it is about."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

_ORDER = {'error': 0, 'stale': 1, 'warn': 2, 'warning': 2}
_MOST = 200


def list_problems(status: dict[str, Any], health: dict[str, Any]) -> list[dict[str, str]]:
    """Return problems as the page lists them: `level`, `text` and `node`, which may be empty."""
    found = [*_of_status(status), *_of_processes(health), *_of_entities(health)]
    return sorted(found, key=lambda each: _ORDER.get(each['level'], 3))[:_MOST]


def _problem(level: str, text: str, node: str = '') -> dict[str, str]:
    return {'level': level, 'text': text, 'node': node}


def _of_status(status: dict[str, Any]) -> Iterator[dict[str, str]]:
    if status.get('last_error'):
        yield _problem('error', f'the last reload failed: {status["last_error"]}')
    for node in status.get('stopped', ()):
        yield _problem('warn', f'{node} was stopped', node)
    for node, state in status.get('lifecycles', {}).items():
        if state != 'active':
            yield _problem('warn', f'{node} is {state}, and not active', node)


def _of_processes(health: dict[str, Any]) -> Iterator[dict[str, str]]:
    for process in health.get('external_processes', ()):
        if process['level'] != 'ok':
            yield _problem(process['level'], f"process '{process['name']}': {process['message']}")
        elif process['restarts']:
            times = f'{process["restarts"]} times'
            yield _problem('warn', f"process '{process['name']}' was restarted {times}")


def _of_entities(health: dict[str, Any]) -> Iterator[dict[str, str]]:
    for row in health.get('entities', ()):
        name = f'{row["kind"]} {row["name"]} of {row["node"]}'
        level = str(row.get('level', 'ok'))
        if level != 'ok':
            yield _problem(level, f'{name}: {row.get("message", level)}', row['node'])
        elif row['errors']:
            text = f'{name}: {row["errors"]:g} errors since the start'
            yield _problem('warn', text, row['node'])
        elif row['dropped']:
            yield _problem('warn', f'{name}: {row["dropped"]:g} messages dropped', row['node'])
