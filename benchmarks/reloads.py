"""A stream at 1 kHz beside many reloads: what it loses, its gaps, and what the reloads leave."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

from benchmarks.behaviours import GAP_BUCKET_SEC
from benchmarks.programs import READY, Program, printed_figures, running
from benchmarks.systems import render_system, unbroken_stream

_BLOCKS = 10
_WARM_UP = 500
_ANSWER_SEC = 30.0
_STOP_SEC = 30.0
_SETTLE_SEC = 1.0
_EMPTY = 'std_msgs/msg/Empty'
_MODULE = """\
WORD = {word!r}


class Counter:
    count = 0


counter = Counter()


def tick(node):
    counter.count += node.parameters.step
    return {{}}


def hear(node, message):
    node.state.heard = WORD
"""


def measure(_side: str, size: int, _seconds: float) -> dict[str, float]:
    """Return what `size` reloads do to a stream, and what they leave behind.

    In turn, a parameter, the period of a timer, the QoS of a subscription, the module of
    behaviours and the number of nodes differ. The stream also runs alone for as long.

    Returns:
        Messages lost, the longest gap (ms) with reloads and alone, MB of growth after warm-up, and
        how many more threads, descriptors, sockets and DDS endpoints there are.
    """
    # With an arena for each thread, malloc keeps megabytes more for a while, and none is held.
    os.environ['MALLOC_ARENA_MAX'] = '1'
    with tempfile.TemporaryDirectory() as folder, _control(Path(folder)) as (program, edits):
        for _ in range(min(size, _WARM_UP)):
            edits.apply_next()
        edits.restore()
        before = edits.count_all(program)
        times: dict[str, list[tuple[float, float]]] = {'reloads': [], 'alone': []}
        for _ in range(_BLOCKS):
            begun = time.monotonic()
            for _ in range(max(size // _BLOCKS, 1)):
                edits.apply_next()
            ended = time.monotonic()
            time.sleep(ended - begun)
            times['reloads'].append((begun, ended))
            times['alone'].append((ended, time.monotonic()))
        edits.restore()
        after = edits.count_all(program)
        program.interrupt()
        told = printed_figures(program, _STOP_SEC)
    figures = {f'{name}_grown': after[name] - before[name] for name in before}
    return {
        'lost': told['lost'],
        'gap_ms': _longest_gap_ms(told['gaps'], times['reloads']),
        'alone_gap_ms': _longest_gap_ms(told['gaps'], times['alone']),
        'reload_ms': 1000 * sum(end - begin for begin, end in times['reloads']) / max(size, 1),
        **figures,
    }


class _Edits:
    """Edits a system that runs, and asks it to reload.

    Args:
        node: Asks it.
    """

    def __init__(self, folder: Path, node: Node) -> None:
        self._folder = folder
        self._node = node
        self._client = node.create_client(Trigger, '/_composer_system/reload')
        self._made = 0
        self._flags = [False] * 5

    def write(self) -> None:
        parameter, timer, subscription, module, has_node = self._flags
        edited = {
            'parameters': {'step': 2 if parameter else 1},
            'state': {'heard': ''},
            'publishers': {'beat': _EMPTY},
            'timers': {
                'beat': {
                    'period': 0.05 if timer else 0.04,
                    'behaviour': 'edited:tick',
                    'publish': 'beat',
                }
            },
            'subscriptions': {
                'hear': {
                    'type': _EMPTY,
                    'topic': 'beat',
                    'behaviour': 'edited:hear',
                    'qos': 5 if subscription else 10,
                }
            },
        }
        more = {'more': {**edited, 'parameters': {'step': 3}}} if has_node else {}
        text = render_system({**unbroken_stream(1000), 'edited': edited, **more})
        (self._folder / 'system.yaml').write_text(text)
        (self._folder / 'edited.py').write_text(_MODULE.format(word='one' if module else 'two'))

    def apply_next(self) -> None:
        """Make one edit more, and wait until the system has reloaded it."""
        which = self._made % len(self._flags)
        self._made += 1
        self._flags[which] = not self._flags[which]
        self.write()
        self._reload()

    def restore(self) -> None:
        """Let the files be as at first."""
        self._flags = [False] * len(self._flags)
        self.write()
        self._reload()
        time.sleep(_SETTLE_SEC)

    def wait_for_system(self) -> None:
        if not self._client.wait_for_service(_ANSWER_SEC):
            message = 'the system cannot be asked'
            raise TimeoutError(message)

    def count_all(self, program: Program) -> dict[str, float]:
        """Return how much the system has of what it must not gather."""
        descriptors = program.descriptors()
        return {
            'mb': program.resident_mb(),
            'threads': program.threads(),
            'descriptors': len(descriptors),
            'sockets': sum(each.startswith('socket:') for each in descriptors),
            'endpoints': self._count_endpoints(),
        }

    def _count_endpoints(self) -> int:
        node = self._node
        names = [name for name, _ in node.get_topic_names_and_types(no_demangle=True)]
        return sum(
            len(find(name, no_mangle=True))
            for name in names
            for find in (node.get_publishers_info_by_topic, node.get_subscriptions_info_by_topic)
        )

    def _reload(self) -> None:
        while True:
            future = self._client.call_async(Trigger.Request())
            rclpy.spin_until_future_complete(self._node, future, timeout_sec=_ANSWER_SEC)
            # The service is there before the system is ready.
            if not (future.done() and 'still starting' in future.result().message):
                break
        if not (future.done() and future.result().success):
            message = f'no reload: {future.result() if future.done() else "no answer"}'
            raise RuntimeError(message)


@contextmanager
def _control(folder: Path) -> Iterator[tuple[Program, _Edits]]:
    rclpy.init()
    edits = _Edits(folder, rclpy.create_node('editor'))
    edits.write()
    with running(['-m', 'composer', 'up', str(folder / 'system.yaml')]) as (program,):
        program.wait_for_line(READY)
        edits.wait_for_system()
        yield program, edits


def _longest_gap_ms(gaps: list[tuple[int, float]], spans: list[tuple[float, float]]) -> float:
    """Return the longest gap that ended within one of some spans of time."""

    def is_inside(bucket: int) -> bool:
        return any(
            begin <= bucket * GAP_BUCKET_SEC and (bucket + 1) * GAP_BUCKET_SEC <= end
            for begin, end in spans
        )

    return 1000 * max((gap for bucket, gap in gaps if is_inside(bucket)), default=0.0)
