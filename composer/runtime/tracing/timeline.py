"""A trace as Perfetto and `chrome://tracing` open it, and its summary in words.

Source: "Trace Event Format", https://github.com/catapult-project/catapult/tree/main/tracing.
A process of it is a node, and a thread is one that has run callbacks of that node.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from composer.runtime.tracing.tracer import MARKS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.runtime.tracing.tracer import TracePart

_MOST_LISTED: Final = 10
_NS_PER_US: Final = 1000
_NS_PER_MS: Final = 1e6


@dataclass(slots=True)
class _Slice:
    """A `TraceEvent`, with the process of the system that it was in.

    Attributes:
        place: The numbers of its node and its track.
        cause: Of a callback, the one in which its message was published.
        first: The callback that began the chain of causes.
    """

    part: str
    kind: str
    node: str
    track: int | str
    name: str
    begun_ns: int
    ended_ns: int
    value: Any
    place: dict[str, int] = field(default_factory=dict)
    cause: _Slice | None = None
    first: _Slice | None = None

    def __str__(self) -> str:
        return f'{self.node} {self.name}'


class Timeline:
    """What all processes of a system have noted.

    Args:
        parts: By process: the name of a worker or of a case, empty for that of the system.
    """

    def __init__(self, parts: Mapping[str, TracePart]) -> None:
        self._parts = parts
        self._begun_ns = min((part.begun_ns for part in parts.values()), default=0)
        self._slices = [
            _Slice(name, *event) for name, part in parts.items() for event in part.events
        ]
        self._slices.sort(key=lambda each: (each.begun_ns, -each.ended_ns))
        self._pids: dict[tuple[str, str], int] = {}
        self._tids: dict[tuple[int, str], int] = {}
        self._threads: dict[tuple[str, int], int] = {}
        lanes: defaultdict[tuple[str, ...], list[int]] = defaultdict(list)
        for each in self._slices:
            each.place = self._place(each, lanes)
        self._find_causes()

    def _place(self, each: _Slice, lanes: Mapping[tuple[str, ...], list[int]]) -> dict[str, int]:
        if isinstance(each.track, int):
            name = self._parts[each.part].threads.get(str(each.track), 'thread')
            number = self._threads.setdefault((each.part, each.track), len(self._threads) + 1)
            track = f'{name} {number}'
        else:
            # What overlaps has tracks of its own.
            ends = lanes[each.part, each.node, each.track, each.kind]
            lane = next((i for i, end_ns in enumerate(ends) if end_ns <= each.begun_ns), len(ends))
            ends[lane : lane + 1] = [each.ended_ns]
            track = f'{each.track} {each.kind}s {lane + 1}' if each.track != MARKS else MARKS
        pid = self._pids.setdefault((each.part, each.node), len(self._pids) + 1)
        # A thread with the number of its process would be its main thread.
        return {'pid': pid, 'tid': self._tids.setdefault((pid, track), 10**6 + len(self._tids))}

    def _find_causes(self) -> None:
        running: defaultdict[tuple[str, int | str], list[_Slice]] = defaultdict(list)
        senders: dict[tuple[str, int], _Slice] = {}
        for each in self._slices:
            if each.kind == 'callback':
                each.cause = senders.get((each.part, each.value))
                each.first = each.cause.first if each.cause else each
                is_in_thread = isinstance(each.track, int)
                running[each.part, each.track if is_in_thread else each.node].append(each)
            elif each.kind == 'publish':
                stack = running[each.part, each.track]
                while stack and stack[-1].ended_ns < each.begun_ns:
                    stack.pop()
                lasting = stack[-1:] or [
                    coroutine
                    for coroutine in running[each.part, each.node]
                    if coroutine.ended_ns >= each.begun_ns
                ]
                # Which of several coroutines it was, nobody knows.
                if len(lasting) == 1:
                    senders.update(((each.part, arrow), lasting[0]) for arrow in each.value)

    def render(self) -> str:
        """Return the file."""
        events = [*self._render_names(), *self._render_slices()]
        return json.dumps({'displayTimeUnit': 'ms', 'traceEvents': events}, separators=(',', ':'))

    def _render_names(self) -> Iterator[dict[str, Any]]:
        for (part, node), pid in self._pids.items():
            name = f'{node} ({part})' if part else node
            yield {'ph': 'M', 'name': 'process_name', 'pid': pid, 'args': {'name': name}}
        for (pid, track), tid in self._tids.items():
            args = {'name': track}
            yield {'ph': 'M', 'name': 'thread_name', 'pid': pid, 'tid': tid, 'args': args}

    def _render_slices(self) -> Iterator[dict[str, Any]]:
        callbacks = [each for each in self._slices if each.kind == 'callback']
        ends = sorted((each.part, each.value) for each in callbacks if each.value)
        numbers = {end: number for number, end in enumerate(ends, 1)}
        for each in self._slices:
            common = {
                'cat': each.kind,
                'name': each.name if each.kind == 'callback' else f'{each.kind} {each.name}',
                'ts': max(0, each.begun_ns - self._begun_ns) / _NS_PER_US,
                **each.place,
            }
            if each.kind == 'queue':
                yield {**common, 'ph': 'C', 'args': {'messages': each.value}}
            elif each.kind in ('dropped', 'late'):
                unit, size = ('messages', 1) if each.kind == 'dropped' else ('ms', _NS_PER_MS)
                yield {**common, 'ph': 'i', 's': 't', 'args': {unit: each.value / size}}
            else:
                duration_ns = max(each.ended_ns - each.begun_ns, 1)
                args = {'node': each.node}
                yield {**common, 'ph': 'X', 'dur': duration_ns / _NS_PER_US, 'args': args}
                # An arrow belongs to the slice before it in the file.
                is_begin = each.kind == 'publish'
                for arrow in each.value if is_begin else [each.value]:
                    if number := numbers.get((each.part, arrow)):
                        named = {'cat': 'message', 'name': 'message', 'id': number}
                        yield {**common, **named, 'ph': 's' if is_begin else 'f', 'bp': 'e'}

    def summarize(self) -> str:
        """Return the longest callbacks, the latest timers, the waits and the longest chain."""
        callbacks = [each for each in self._slices if each.kind == 'callback']
        end_ns = max((part.ended_ns for part in self._parts.values()), default=self._begun_ns)
        longest = sorted(callbacks, key=lambda each: each.begun_ns - each.ended_ns)
        sections = {
            'longest callbacks': [
                f'{_ms(each.ended_ns - each.begun_ns)}  {each} at {self._sec(each.begun_ns)}'
                for each in longest[:_MOST_LISTED]
            ],
            'latest timers': self._list(max, 'late'),
            'waits': self._list(sum, 'call', 'wait'),
            'dropped messages': self._list(sum, 'dropped'),
            'longest chain': _describe_chain(callbacks),
        }
        lines = [f'{len(callbacks)} callbacks in {self._sec(end_ns)}']
        for title, listed in sections.items():
            lines += [f'{title}:', *(f'  {line}' for line in listed)] if listed else []
        if lost := sum(part.lost for part in self._parts.values()):
            lines.append(f'{lost} more events were left out: trace for a shorter time')
        return '\n'.join(lines)

    def _sec(self, time_ns: int) -> str:
        return f'{max(0, time_ns - self._begun_ns) / 1e9:.3f} s'

    def _list(self, merge: Any, *kinds: str) -> list[str]:
        """Return a line for each node and name, by the sum or the maximum of what it has."""
        values: defaultdict[str, list[int]] = defaultdict(list)
        for each in self._slices:
            if each.kind in kinds:
                took_ns = each.ended_ns - each.begun_ns
                title = f'{each.node} for {each.name}' if 'wait' in kinds else str(each)
                values[title].append(took_ns if 'wait' in kinds else each.value)
        merged = Counter({title: merge(listed) for title, listed in values.items()})
        return [
            f'{value if "dropped" in kinds else _ms(value)}  {title}, {len(values[title])} times'
            for title, value in merged.most_common(_MOST_LISTED)
        ]


def _describe_chain(callbacks: list[_Slice]) -> list[str]:
    """Return the steps of what took longest from a first callback to the last that it led to."""
    step = max(
        (each for each in callbacks if each.cause),
        key=lambda each: each.ended_ns - each.first.begun_ns if each.first else 0,
        default=None,
    )
    steps: list[str] = []
    while step is not None and step.first is not None:
        steps.insert(0, f'{_ms(step.ended_ns - step.first.begun_ns)}  {step}')
        step = step.cause
    return steps


def _ms(duration_ns: float) -> str:
    return f'{duration_ns / _NS_PER_MS:9.3f} ms'
