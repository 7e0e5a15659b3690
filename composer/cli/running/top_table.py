"""The table of `composer top`: its columns, and which rows are shown in which order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.cli.running.tables import render_table
from composer.records import record
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@record
class Column:
    """A column.

    Attributes:
        title: Its name, by which it is sorted, too.
        value: Returns what it is sorted by; `None` for what is not known.
        show: Returns what is shown of a value.
    """

    title: str
    value: Callable[[Mapping[str, Any]], Any]
    show: Callable[[Any], str]


def _field(key: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda entity: entity[key]


def _times(value: float) -> str:
    return f'{value:.3f}'


def _describe(entity: Mapping[str, Any]) -> str:
    key = f' ({entity["key"]})' if entity['key'] else ''
    return f'{entity["node"]}: {entity["kind"]} {entity["name"]}{key}'.replace(' :', ':').rstrip()


def _missed(entity: Mapping[str, Any]) -> int:
    return int(entity['late']) + int(entity['skipped'])


def _delivery(entity: Mapping[str, Any]) -> str | None:
    parts = filter(None, (entity['delivery'], entity['delivery_reason']))
    return escape(', '.join(parts)) or None


COLUMNS = (
    Column('ENTITY', _describe, str),
    Column('RATE/S', _field('rate_hz'), lambda value: f'{value:.1f}'),
    Column('MEAN MS', _field('mean_ms'), _times),
    Column('P99 MS', _field('p99_ms'), _times),
    Column('MAX MS', _field('max_ms'), _times),
    Column('CPU', _field('cpu'), lambda value: f'{value:.1%}'),
    Column('GIL', _field('gil'), lambda value: f'{value:.1%}'),
    Column('QUEUE', _field('queued'), str),
    Column('DROPPED', _field('dropped'), str),
    Column('LATE', _missed, str),
    Column('ERRORS', _field('errors'), str),
    Column('DELIVERY', _delivery, str),
)
# Only of systems with workers; an empty one is the process of the system.
_WORKER = Column('WORKER', lambda entity: escape(entity['worker']) or None, str)
# Only of several hosts.
_HOST = Column('HOST', lambda entity: escape(entity.get('host', '')) or None, str)
SORT_NAMES = {
    **{each.title.lower().partition(' ')[0].partition('/')[0]: each for each in COLUMNS},
}
DEFAULT_SORT = 'cpu'
# A callback that computes keeps others waiting for a millisecond, the executor's switch interval.
_WAITED_MS = 0.5
_KEPT_SHARE = 0.1


@record
class View:
    """Which rows are shown, and in which order.

    Attributes:
        sort: A key of `SORT_NAMES`.
        is_reversed: Whether the order is the other one: figures begin with the highest.
        text: Only entities with this text in their names, in any case.
    """

    sort: str = DEFAULT_SORT
    is_reversed: bool = False
    text: str = ''


def select_entities(entities: Sequence[Mapping[str, Any]], view: View) -> list[Mapping[str, Any]]:
    """Return the entities to show, in their order; what is not known comes last."""
    column = SORT_NAMES[view.sort]
    shown = [each for each in entities if view.text.lower() in _describe(each).lower()]
    shown.sort(key=_describe)
    known = [each for each in shown if column.value(each) is not None]
    is_text = column in (COLUMNS[0], COLUMNS[-1])
    known.sort(key=column.value, reverse=is_text == view.is_reversed)
    return known + [each for each in shown if column.value(each) is None]


def find_worst(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return which entities kept the interpreter (GIL) from others that waited for it.

    Returns:
        One at most for each process: `host` if there are several, `worker`, `node`, `entity`,
        its share `gil`, and how long the others waited, `wait_mean_ms` and `wait_max_ms`.
    """
    return [worst for each in document['processes'] if (worst := _worst_of(document, each))]


def _place(each: Mapping[str, Any]) -> tuple[str, str]:
    return each.get('host', ''), each['worker']


def _worst_of(document: Mapping[str, Any], process: Mapping[str, Any]) -> dict[str, Any] | None:
    mates = [each for each in document['entities'] if _place(each) == _place(process)]
    known = [each for each in mates if each['gil'] is not None]
    worst = max(known, key=lambda each: float(each['gil']), default=None)
    if worst is None or worst['gil'] < _KEPT_SHARE:
        return None
    has_others = any(each['node'] != worst['node'] and each['calls'] for each in mates)
    if not has_others or (process['gil_wait_mean_ms'] or 0.0) < _WAITED_MS:
        return None
    where = {'host': worst['host']} if 'host' in worst else {}
    return {
        **where,
        'worker': worst['worker'],
        'node': worst['node'],
        'entity': _describe(worst).removeprefix(f'{worst["node"]}: '),
        'gil': worst['gil'],
        'wait_mean_ms': process['gil_wait_mean_ms'],
        'wait_max_ms': process['gil_wait_max_ms'],
    }


def describe_worst(worst: Mapping[str, Any]) -> str:
    """Return a line about one that `find_worst` returned."""
    where = f' in worker {worst["worker"]}' if worst['worker'] else ''
    where += f' on host {worst["host"]}' if 'host' in worst else ''
    return escape(
        f'{worst["node"]}: {worst["entity"]} keeps the interpreter (GIL){where} '
        f'{worst["gil"]:.0%} of the time: the others wait {worst["wait_mean_ms"]:.1f} ms for it '
        f'on average, {worst["wait_max_ms"]:.1f} ms at most'
    )


def render_entities(entities: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines of the table, its header first."""
    has_workers = any(each['worker'] for each in entities)
    has_hosts = any(each.get('host') for each in entities)
    entity, *figures = COLUMNS
    columns = (entity, *(_HOST,) * has_hosts, *figures, *(_WORKER,) * has_workers)
    rows = [
        ['-' if (value := each.value(entity)) is None else each.show(value) for each in columns]
        for entity in entities
    ]
    return render_table([each.title for each in columns], rows)
