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
    Column('QUEUE', _field('queued'), str),
    Column('DROPPED', _field('dropped'), str),
    Column('LATE', _missed, str),
    Column('ERRORS', _field('errors'), str),
    Column('DELIVERY', _delivery, str),
)
SORT_NAMES = {
    **{each.title.lower().partition(' ')[0].partition('/')[0]: each for each in COLUMNS},
}
DEFAULT_SORT = 'cpu'


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


def render_entities(entities: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines of the table, its header first."""
    rows = [
        ['-' if (value := each.value(entity)) is None else each.show(value) for each in COLUMNS]
        for entity in entities
    ]
    return render_table([each.title for each in COLUMNS], rows)
