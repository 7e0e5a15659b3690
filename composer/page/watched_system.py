"""What a page shows of a running system, which is asked again and again."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import count
from pathlib import Path
from threading import Event, Thread
from time import monotonic, time
from typing import TYPE_CHECKING, Any

from composer.application.plan import plan_from
from composer.application.running_systems import answer_forms
from composer.application.running_systems.client import STATUS_SEC, Client, RunningSystem
from composer.application.running_systems.discovery import Discovery
from composer.application.running_systems.health import read_health
from composer.application.system_reader import list_files
from composer.application.watched_files import WatchedFiles
from composer.diagnostics import describe_finding
from composer.errors import ComposerError
from composer.page.drawn_parts import draw_files
from composer.page.problems import find_outside, list_problems
from composer.planning.text import render_plan
from composer.runtime.control import protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.page.drawn_parts import Drawing

_SNAPSHOT_SEC = 30.0
# How often what seldom changes is asked for, in seconds.
_STATUS_PERIOD_SEC = 2.0
_POLL_SEC = 0.1
# How much longer than a look at all topics the pause after it is.
_PAUSES = 9.0
# Who has asked so recently looks at the answer.
_LOOK_SEC = 5.0
# While nobody looks, it is asked as seldom, and not for its health, which it would measure.
_IDLE_SEC = 10.0
_MOST_LINES = 500
_LONGEST_LINE = 2000
_MOST_PLAN_LINES = 200
_LEVELS = {10: 'debug', 20: 'info', 30: 'warn', 40: 'error', 50: 'fatal'}


class WatchedSystem:
    """Asks a running system in a thread of its own.

    Args:
        name: Of the system; `None` for the only one.
        drawing: Of files that do not run: nobody is asked.

    Attributes:
        state: What the page shows, but for the drawing; another object after each change.
        drawing: Of its files; `None` if they cannot be drawn.
        log: The last lines of `/rosout`.
        system: As it was found; `None` if it does not run.
        looked_at: When somebody looked last, on the monotonic clock.
    """

    def __init__(self, name: str | None, drawing: Drawing | None = None) -> None:
        self._name = name
        self.drawing = drawing
        self.state: dict[str, Any] = {
            'name': drawing.name if drawing else name or '',
            'runs': False,
            'drawing': int(drawing is not None),
        }
        self.log: deque[dict[str, Any]] = deque(maxlen=_MOST_LINES)
        self.system: RunningSystem | None = None
        self.looked_at = monotonic()
        self._saved: SavedFiles | None = None
        self._numbers = count(1)
        self._outside: dict[str, list[dict[str, str]]] = {}
        self._next_outside = 0.0
        self._ended = Event()
        self._thread = Thread(target=self._run, name='composer-page', daemon=True)
        # What is asked, as a reload, may take long: what is watched stays fresh meanwhile.
        self._answerer = ThreadPoolExecutor(1, 'composer-asks')
        self._asked: Future[Client] = Future()

    def start(self) -> None:
        """Begin to ask."""
        if self.drawing is None:
            self._thread.start()
        else:
            self._asked.set_exception(ComposerError('the system does not run'))

    def stop(self) -> None:
        """Ask no more."""
        self._ended.set()
        if self._thread.ident is not None:
            self._thread.join(STATUS_SEC)

    def ask(self, question: Callable[[Client], Any]) -> Future[Any]:
        """Call a function with a client in another thread, one after the other."""
        return self._answerer.submit(lambda: question(self._asked.result(_SNAPSHOT_SEC)))

    def _run(self) -> None:
        try:
            with Client() as client, Client() as asked:
                self._asked.set_result(asked)
                self._hear_log(client)
                while not self._ended.is_set():
                    self._watch(client)
                asked.interrupt()
                self._answerer.shutdown(cancel_futures=True)
        except Exception as error:  # noqa: BLE001 - the page shows it
            self._tell_gone(error)
            if not self._asked.done():
                self._asked.set_exception(error)

    def _watch(self, client: Client) -> None:
        """Ask the system until it ends."""
        try:
            system = self.system = Discovery(client).find(self._name)
            with (
                client.asking(system, protocol.STATUS) as ask_status,
                client.asking(system, protocol.TOP) as ask_health,
            ):
                self._draw(client, system)
                self._follow(client, system, ask_status, ask_health)
        except Exception as error:  # noqa: BLE001 - the page shows it, and asks again
            self.system = None
            self._tell_gone(error)
            self._spin(client, monotonic() + 1.0)

    def _tell_gone(self, error: Exception) -> None:
        kept = {key: self.state[key] for key in ('name', 'drawing')}
        self.state = {**kept, 'runs': False, 'problem': str(error)}

    def _follow(self, client: Client, system: RunningSystem, status: Any, health: Any) -> None:
        said: dict[str, Any] = {}
        found: dict[str, Any] = {}
        next_status = next_health = 0.0
        while not self._ended.is_set():
            begun = monotonic()
            if begun >= next_status:
                next_status = begun + _STATUS_PERIOD_SEC
                before = said
                said = answer_forms.read_answer(status(STATUS_SEC).text, answer_forms.STATUS)
                said |= {'heard': time(), 'period_sec': _STATUS_PERIOD_SEC}
                if before and any(before[key] != said[key] for key in ('last_reload', 'stopped')):
                    self._draw(client, system)
                self._find_outside(client, said)
            if self._saved:
                self._saved.look()
            # Once a period: an answer of all entities is dear to the system.
            if begun >= next_health and (not found or self._is_looked_at()):
                found = self._read_health(health)
                next_health = begun + found['period_sec']
                self._note_heard(said, found)
            drawn = self.drawing
            known = (drawn.topic_of_ends, drawn.rates) if drawn else ({}, {})
            self.state = self.state | {
                'name': said['name'],
                'runs': True,
                'problem': found.get('problem', ''),
                'status': said,
                'health': found,
                'outside': self._outside,
                'problems': list_problems(said, found, self._outside, *known),
                'next': self._saved and self._saved.next_plan,
            }
            # A silent worker takes a second of the pause: the others do not seem old for it.
            self._spin(client, max(min(next_health, next_status), monotonic() + _POLL_SEC))
            idle_until = monotonic() + _IDLE_SEC
            while not (self._is_looked_at() or self._ended.is_set() or monotonic() > idle_until):
                self._spin(client, monotonic() + _POLL_SEC)

    def _is_looked_at(self) -> bool:
        return monotonic() < self.looked_at + _LOOK_SEC

    def _read_health(self, ask: Any) -> dict[str, Any]:
        try:
            return read_health(ask(STATUS_SEC))
        except ComposerError as error:
            # As where `diagnostics: false` measures nothing.
            return {'entities': [], 'period_sec': 1.0, 'problem': str(error)}

    def _note_heard(self, said: dict[str, Any], found: dict[str, Any]) -> None:
        """Add to each entity when it was `heard`; those of a silent worker stay as they were."""
        now, before = time(), self.state.get('health', {})
        # What the system itself measured in one period is asked for more than once.
        is_same = found.get('period') == before.get('period')
        found['heard'] = before.get('heard', now) if is_same else now
        for row in found['entities']:
            row['heard'] = now if row['worker'] else found['heard']
        silent = {each['name'] for each in said['workers']}
        silent -= {row['worker'] for row in found['entities']}
        rows = before.get('entities', ())
        found['entities'] += [row for row in rows if row['worker'] in silent]

    def _draw(self, client: Client, system: RunningSystem) -> None:
        problem = ''
        try:
            text = client.ask(system, protocol.SNAPSHOT, _SNAPSHOT_SEC).text
            given = answer_forms.read_answer(text, answer_forms.SNAPSHOT)['given']
            file = Path((system.status or {}).get('file', ''))
            paths = [file, *(Path(each) for each in given['layers'])]
            self._saved = SavedFiles(text, paths, given['words'], given['set_values'])
            drawing = draw_files(paths, given['words'], given['set_values'])
            if self._outside:
                drawing.show_outside(self._outside)
            self.drawing = drawing
        except ComposerError as error:
            # The page is for the same computer as the files, and shows the rest without.
            self.drawing, problem = None, str(error)
        self._note_drawing(problem)

    def _find_outside(self, client: Client, said: dict[str, Any]) -> None:
        begun = monotonic()
        if (drawing := self.drawing) is not None and begun > self._next_outside:
            own = {*said['nodes'], *said['components'], *drawing.nodes}
            outside = find_outside(client.node, drawing.topics, own)
            if outside != self._outside:
                self._outside = outside
                drawing.show_outside(outside)
                self._note_drawing()
            # Each topic is asked for: of a large graph, in a tenth of the time at most.
            self._next_outside = monotonic() + _PAUSES * (monotonic() - begun)

    def _note_drawing(self, problem: str = '') -> None:
        number = self.state['drawing'] + 1
        self.state = self.state | {'drawing': number, 'drawing_problem': problem}

    def _hear_log(self, client: Client) -> None:
        from rcl_interfaces.msg import Log
        from rclpy.qos import DurabilityPolicy, QoSProfile

        # As the log is published: what was said before comes, too.
        profile = QoSProfile(depth=_MOST_LINES, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        client.node.create_subscription(Log, '/rosout', self._note_line, profile)

    def _note_line(self, message: Any) -> None:
        line = {
            'number': next(self._numbers),
            'time': message.stamp.sec + message.stamp.nanosec / 1e9,
            'level': _LEVELS.get(message.level, 'info'),
            'name': message.name[:_LONGEST_LINE],
            'text': message.msg[:_LONGEST_LINE],
        }
        self.log.append(line)

    def _spin(self, client: Client, until: float) -> None:
        """Hear what comes for a while."""
        while monotonic() < until and not self._ended.is_set():
            client.executor.spin_once(timeout_sec=_POLL_SEC)


class SavedFiles:
    """Compares the files of a system with what runs, whenever one of them is saved.

    Args:
        running: What it runs from; for the others, too, see `plan_from`.

    Attributes:
        next_plan: `lines`, as `composer plan` prints them, and `findings`; `None` if a reload
            would change nothing.
    """

    def __init__(
        self, running: str, paths: list[Path], words: list[str], set_values: list[str]
    ) -> None:
        self.next_plan: dict[str, Any] | None = None
        self._given = running, paths, words, set_values
        # None has been read so far.
        self._files = WatchedFiles(paths, begun_ns=0)
        self._thread: Thread | None = None

    def look(self) -> None:
        """Plan anew, in a thread of its own, if a file was saved; soon `next_plan` is there."""
        if (self._thread and self._thread.is_alive()) or not self._files.list_changed():
            return
        self._files.note_reading()
        self._thread = Thread(target=self._plan, name='composer-next-plan', daemon=True)
        self._thread.start()

    def _plan(self) -> None:
        lines: list[str] = []
        findings: list[Any] = []
        try:
            plan, found, context = plan_from(*self._given)
            if context is not None:
                self._files.follow(list_files(context))
            if plan is None:
                findings = [describe_finding(each) for each in found]
            elif plan.operations:
                lines = render_plan(plan).splitlines()[:_MOST_PLAN_LINES]
        except (ComposerError, OSError) as error:
            # A file may go while it is read.
            lines = [str(error)]
        self.next_plan = {'lines': lines, 'findings': findings} if lines or findings else None
