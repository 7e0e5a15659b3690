"""The table of `composer top`: its columns, and which rows are shown in which order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.cli.running.tables import GAP, render_processes, render_table
from composer.records import record
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from collections.abc import Set as AbstractSet


@record
class Column:
    """A column.

    Attributes:
        title: Its name, by which it is sorted, too.
        value: Returns what it is sorted by; `None` for what is not known.
        show: Returns what is shown of a value.
        rank: Where the terminal is too narrow, columns of a higher rank are left out first.
        least: The narrowest that it may be, if there is room; `None` if its cells are never
            shortened.
    """

    title: str
    value: Callable[[Mapping[str, Any]], Any]
    show: Callable[[Any], str]
    rank: int
    least: int | None = None


def _field(key: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda entity: entity[key]


def _times(value: float) -> str:
    return f'{value:.3f}'


def _describe(entity: Mapping[str, Any]) -> str:
    if 'kind' not in entity:
        return str(entity['node'])
    key = f' ({entity["key"]})' if entity['key'] else ''
    return f'{entity["node"]}: {entity["kind"]} {entity["name"]}{key}'.replace(' :', ':').rstrip()


def _missed(entity: Mapping[str, Any]) -> int:
    return int(entity['late']) + int(entity['skipped'])


def _delivery(entity: Mapping[str, Any]) -> str | None:
    parts = filter(None, (entity['delivery'], entity['delivery_reason']))
    return escape(', '.join(parts)) or None


COLUMNS = (
    Column('ENTITY', _describe, str, 0, 28),
    Column('RATE/S', _field('rate_hz'), lambda value: f'{value:.1f}', 3),
    Column('MEAN MS', _field('mean_ms'), _times, 11),
    Column('P99 MS', _field('p99_ms'), _times, 12),
    Column('MAX MS', _field('max_ms'), _times, 13),
    Column('CPU', _field('cpu'), lambda value: f'{value:.1%}', 2),
    Column('QUEUE', _field('queued'), str, 6),
    Column('DROPPED', _field('dropped'), str, 5),
    Column('LATE', _missed, str, 10),
    Column('ERRORS', _field('errors'), str, 4),
    Column('DELIVERY', _delivery, str, 7, 8),
)
# Only of systems with workers; an empty one is the process of the system.
_WORKER = Column('WORKER', lambda entity: escape(entity['worker']) or None, str, 8, 6)
SORT_NAMES = {
    **{each.title.lower().partition(' ')[0].partition('/')[0]: each for each in COLUMNS},
}
DEFAULT_SORT = 'cpu'
# Names are at least so long before columns of a higher rank than this have a place.
# Narrower cells are cut as a whole, not node and entity each.
_SPLIT = 8
_READABLE, _READABLE_RANK, _LAST_RANK = 48, 9, 13
_OF_NODE = ('worker', 'node', 'level', 'message')
_COUNTS = ('calls', 'errors', 'dropped', 'late', 'skipped')
_SEVERITIES = {'warn': 1, 'error': 2}
# A callback that computes keeps others waiting for a millisecond, the executor's switch interval.
_WAITED_MS = 0.5
_BUSY = 0.1


@record
class View:
    """Which rows are shown, and in which order.

    Attributes:
        sort: A key of `SORT_NAMES`.
        is_reversed: Whether the order is the other one: figures begin with the highest.
        text: Only rows with this text in their names, in any case.
        by: What a row is: `entity` or `node`.
    """

    sort: str = DEFAULT_SORT
    is_reversed: bool = False
    text: str = ''
    by: str = 'entity'


def select_entities(entities: Sequence[Mapping[str, Any]], view: View) -> list[Mapping[str, Any]]:
    """Return the rows to show, in their order; what is not known comes last."""
    column = SORT_NAMES[view.sort]
    rows = sum_nodes(entities) if view.by == 'node' else entities
    shown = [each for each in rows if view.text.lower() in _describe(each).lower()]
    shown.sort(key=_describe)
    known = [each for each in shown if column.value(each) is not None]
    is_text = column in (COLUMNS[0], COLUMNS[-1])
    known.sort(key=column.value, reverse=is_text == view.is_reversed)
    return known + [each for each in shown if column.value(each) is None]


def sum_nodes(entities: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each node: the sums of its entities, and the times of the slowest of them.

    The rate is that of calls: messages that publishers and clients send are not among them.
    """
    nodes: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for entity in entities:
        nodes.setdefault((entity['worker'], entity['node']), []).append(entity)
    return [_sum_node(own) for own in nodes.values()]


def _sum_node(own: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    def known(key: str) -> list[Any]:
        return [entity[key] for entity in own if entity[key] is not None]

    calls = [
        (entity['rate_hz'] or 0.0, entity['mean_ms'])
        for entity in own
        if entity['mean_ms'] is not None
    ]
    calls_hz = sum(rate_hz for rate_hz, _ in calls)
    busy_ms = sum(rate_hz * mean_ms for rate_hz, mean_ms in calls)
    worst = max(own, key=lambda entity: _SEVERITIES.get(str(entity.get('level')), 0))
    return {
        **{key: worst[key] for key in _OF_NODE if key in worst},
        'rate_hz': calls_hz,
        'mean_ms': busy_ms / calls_hz if calls_hz else None,
        **{key: max(known(key), default=None) for key in ('p99_ms', 'max_ms')},
        **{key: sum(known(key)) if known(key) else None for key in ('cpu', 'queued')},
        **{key: sum(entity.get(key, 0) for entity in own) for key in _COUNTS},
        # 'sent' if anything goes over the middleware.
        'delivery': max(known('delivery'), default=None),
        'delivery_reason': '',
    }


def find_worst(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return which entities used most of a core while others waited for the interpreter (GIL).

    Returns:
        One at most for each process: `worker`, `node`, `entity`, its share of a core `cpu`, and
        how long the others waited, `wait_mean_ms` and `wait_max_ms`.
    """
    return [worst for each in document['processes'] if (worst := _worst_of(document, each))]


def _worst_of(document: Mapping[str, Any], process: Mapping[str, Any]) -> dict[str, Any] | None:
    mates = [each for each in document['entities'] if each['worker'] == process['worker']]
    known = [each for each in mates if each['cpu'] is not None]
    worst = max(known, key=lambda each: float(each['cpu']), default=None)
    if worst is None or worst['cpu'] < _BUSY:
        return None
    has_others = any(each['node'] != worst['node'] and each['calls'] for each in mates)
    if not has_others or (process['gil_wait_mean_ms'] or 0.0) < _WAITED_MS:
        return None
    return {
        'worker': worst['worker'],
        'node': worst['node'],
        'entity': _describe(worst).removeprefix(f'{worst["node"]}: '),
        'cpu': worst['cpu'],
        'wait_mean_ms': process['gil_wait_mean_ms'],
        'wait_max_ms': process['gil_wait_max_ms'],
    }


def describe_worst(worst: Mapping[str, Any]) -> str:
    """Return a line about one that `find_worst` returned."""
    where = f' in worker {worst["worker"]}' if worst['worker'] else ''
    return escape(
        f'{worst["node"]}: {worst["entity"]}{where} uses {worst["cpu"]:.0%} of a core: other '
        f'callbacks wait {worst["wait_mean_ms"]:.1f} ms for the interpreter (GIL) on average, '
        f'{worst["wait_max_ms"]:.1f} ms at most'
    )


def list_processes(document: Mapping[str, Any]) -> list[str]:
    """Return the lines of the table of external processes."""
    name = document['name'].partition('@')[0]
    return render_processes((name, process) for process in document['external_processes'])


def render_entities(
    entities: Sequence[Mapping[str, Any]], sort: str = DEFAULT_SORT, width: int | None = None
) -> list[str]:
    """Return the lines of the table, its header first.

    Args:
        sort: The column that is shown in any case: a key of `SORT_NAMES`.
        width: The longest that a line may be, for which names are shortened and columns left out.
    """
    has_workers = any(each['worker'] for each in entities)
    entity, *figures = COLUMNS
    columns = (entity, *figures, *(_WORKER,) * has_workers)
    cells = {
        each: [
            each.title,
            *(
                '-' if (value := each.value(entity)) is None else each.show(value)
                for entity in entities
            ),
        ]
        for each in columns
    }
    if entities and 'kind' not in entities[0]:
        cells[entity][0] = 'NODE'
    if width is not None:
        cells = _fit(cells, SORT_NAMES[sort], width)
    header, *rows = zip(*cells.values(), strict=True)
    return render_table(header, rows)


def _fit(cells: Mapping[Column, list[str]], sort: Column, width: int) -> dict[Column, list[str]]:
    """Return the columns that fit into lines of `width`, with their cells shortened."""
    room = width + len(GAP)
    wanted = {each: max(map(len, texts)) for each, texts in cells.items()}
    least = {each: each.least or wanted[each] for each in cells}
    names, beside = COLUMNS[0], 0 if sort is COLUMNS[0] else wanted[sort] + len(GAP)
    least[names] = _find_least(set(cells[names]), width - beside) or min(least[names], width)
    steps = [(each.rank * (each is not sort), each, least[each]) for each in cells]
    steps += [(_READABLE_RANK, names, max(_READABLE, least[names]))]
    steps += [(each.rank + _LAST_RANK, each, wanted[each]) for each in cells if each.least]
    widths: dict[Column, int] = {}
    for _, each, target in sorted(steps, key=lambda step: step[0]):
        now = widths.get(each, -len(GAP))
        more = min(target, wanted[each]) - now
        more = min(more, room) if each in widths else more
        if more <= room:
            widths[each] = now + more
            room -= more
    return {
        each: [_shorten(text, widths[each]) for text in texts]
        for each, texts in cells.items()
        if each in widths
    }


def _find_least(names: AbstractSet[str], most: int) -> int | None:
    """Return how long names must be to be told apart; `None` if that is too long."""
    for width in range(COLUMNS[0].least or 0, most + 1):
        if len({_shorten(name, width) for name in names}) == len(names):
            return width
    return None


def _shorten(text: str, width: int) -> str:
    """Return a text of at most `width` characters; names keep their beginning and their end."""
    if len(text) <= width:
        return text
    node, colon, task = text.partition(': ')
    if not colon or width < _SPLIT:
        end = (width - 1) // 2
        return f'{text[: width - 1 - end]}…{text[len(text) - end :]}'
    room = width - len(colon)
    task = _shorten(task, max(room // 2, room - len(node)))
    return f'{_shorten(node, room - len(task))}{colon}{task}'
