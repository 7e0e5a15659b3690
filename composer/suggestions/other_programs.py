"""How many processor cores programs use that are not of the system."""

from __future__ import annotations

from pathlib import Path

_STAT = Path('/proc/stat')
# Of the times of a core since boot, in the order of proc_stat(5): guests are in those of users.
_IDLE = slice(3, 5)
_ALL = slice(0, 8)


def read_processors() -> str:
    """Return what Linux tells of the times of processors; nothing elsewhere."""
    try:
        return _STAT.read_text(encoding='utf-8')
    except OSError:
        return ''


def cores_of_others(before: str, after: str, own: float, cores: int) -> float:
    """Return how many cores others used between two readings; 0 if that cannot be known.

    Args:
        own: How many the system used.
        cores: How many it may use. If they are not all, who uses them is not known.
    """
    first, last = _parse(before), _parse(after)
    count = sum(line.startswith('cpu') for line in after.splitlines()) - 1
    if first is None or last is None or count != cores:
        return 0.0
    elapsed, idle = last[0] - first[0], last[1] - first[1]
    busy = count * (elapsed - idle) / elapsed if elapsed > 0 else 0.0
    return max(0.0, busy - own)


def _parse(text: str) -> tuple[int, int] | None:
    """Return the ticks of all cores together, and how many of them were idle."""
    name, *ticks = text.partition('\n')[0].split() or ['']
    if name != 'cpu' or len(ticks) < _ALL.stop or not all(map(str.isdecimal, ticks)):
        return None
    counts = [int(each) for each in ticks]
    return sum(counts[_ALL]), sum(counts[_IDLE])
