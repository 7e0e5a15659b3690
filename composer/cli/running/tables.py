"""Tables of text, and how their figures are written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

GAP = '  '
_PROCESSES = ('SYSTEM', 'PROCESS', 'STATE', 'PID', 'RESTARTS', 'CPU', 'MEMORY MB')
_MEGABYTE = 1e6
_MINUTE_SEC, _HOUR_SEC, _DAY_SEC = 60, 3600, 86400


def render_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table; columns of which all cells are numbers stand to the right."""
    body = [[escape(cell) for cell in row] for row in rows]
    columns = list(zip(header, *body, strict=True))
    widths = [max(map(len, column)) for column in columns]
    rights = [bool(body) and all(map(_is_number, column[1:])) for column in columns]
    return [
        GAP.join(
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(row, widths, rights, strict=True)
        ).rstrip()
        for row in [header, *body]
    ]


def render_processes(processes: Iterable[tuple[str, Mapping[str, Any]]]) -> list[str]:
    """Return the lines of a table of external processes, none if there are none.

    Args:
        processes: Each with the name of its system, as `ps` and `top` are told of them.
    """
    rows = [
        (
            system,
            process['name'],
            process['state'],
            '-' if process['pid'] is None else str(process['pid']),
            str(process['restarts']),
            '-' if process['cpu'] is None else f'{process["cpu"]:.1%}',
            '-' if (size := process['memory_bytes']) is None else f'{size / _MEGABYTE:.1f}',
        )
        for system, process in processes
    ]
    return render_table(_PROCESSES, rows) if rows else []


def format_duration(seconds: float) -> str:
    """Return `12 s`, `5 min`, `3 h` or `2 d`."""
    if seconds < _MINUTE_SEC:
        return f'{seconds:.0f} s'
    if seconds < _HOUR_SEC:
        return f'{seconds / _MINUTE_SEC:.0f} min'
    if seconds < _DAY_SEC:
        return f'{seconds / _HOUR_SEC:.0f} h'
    return f'{seconds / _DAY_SEC:.0f} d'


def _is_number(cell: str) -> bool:
    return cell in ('', '-') or cell.rstrip('%').replace('.', '', 1).isdigit()
