"""The systems of a test in Python: they run in virtual time, in the process of pytest."""

from __future__ import annotations

import json
import warnings
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any

import pytest

from composer.application.file_selection import load_given
from composer.checks.checker import check_system
from composer.diagnostics import has_errors
from composer.errors import ComposerError, StartError, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.values.start_reader import StartValueReader
from composer.reports.text import render_finding
from composer.scenarios.running.failure_reports import list_log
from composer.scenarios.running.fixed_environment import isolated_environment
from composer.simulation.simulated_system import SimulatedSystem
from composer.simulation.trace import render_event

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from composer.language.loaded_system import LoadedSystem
    from composer.simulation.events import Event

with warnings.catch_warnings(), suppress(ImportError):
    # The parser of interfaces imports what Python is going to remove; no test is to blame for it.
    warnings.simplefilter('ignore', DeprecationWarning)
    import rosidl_parser.parser  # noqa: F401

# pytest shows where a test failed, and nothing of this module.
__tracebackhide__ = True

# Of what happened before a test failed, the end is shown.
_MOST_EVENTS, _MOST_LINES = 20, 30
# A behaviour that is looked at in a debugger takes its time.
_REAL_LIMIT_SEC = 60.0
_NO_LIMIT_SEC = 1e6


class TestedSystem(SimulatedSystem):
    """A system that a test drives; see `SimulatedSystem` for what it can do."""

    __test__ = False

    def __init__(self, system: LoadedSystem, *, seed: int, real_limit_sec: float) -> None:
        super().__init__(system, seed=seed, real_limit_sec=real_limit_sec)
        self.errors_were_read = False

    @property
    def errors(self) -> list[Event]:
        """What behaviours have raised so far; whoever reads it says whether that is an error.

        If nobody reads it, the test fails at its end.
        """
        self.errors_were_read = True
        return self.raised()

    def raised(self) -> list[Event]:
        """Return what behaviours have raised so far."""
        return [event for event in self.events if event.kind == 'error']


class TestedSystems:
    """Starts systems for one test.

    Args:
        folder: That of the test.

    Attributes:
        has_failed: Whether the test has failed by itself.
    """

    __test__ = False

    def __init__(self, folder: Path, config: pytest.Config) -> None:
        self._folders = list(dict.fromkeys([folder, config.rootpath]))
        is_debugged = config.getoption('usepdb') or config.getoption('trace')
        self._limit_sec = _NO_LIMIT_SEC if is_debugged else _REAL_LIMIT_SEC
        self._systems: list[TestedSystem] = []
        self._stack = ExitStack()
        self.has_failed = False

    def __call__(
        self,
        path: str | Path,
        *,
        layers: Sequence[str | Path] = (),
        set_values: Sequence[str] = (),
        seed: int = 0,
        **arguments: Any,
    ) -> TestedSystem:
        """Start a system; it runs until the test ends, or `stop` is called.

        Args:
            layers: Files that change the first one, applied in order.
            set_values: Values to change, as in `nodes.talker.log_level=debug`.
            seed: What random numbers depend on.
            arguments: Values for the arguments that the file declares.

        Raises:
            UsageError: There is no such file, or the arguments do not fit it.
            ComposerError: The system has errors, or another one still runs.
            StartError: It could not start.
        """
        paths = [self._find(each) for each in (path, *layers)]
        words = [f'{name}:={_format(value)}' for name, value in arguments.items()]
        loaded = load_given(paths, words, set_values, reader=StartValueReader())
        _refuse_errors(loaded)
        if not self._systems:
            self._stack.enter_context(isolated_environment())
        system = TestedSystem(loaded, seed=seed, real_limit_sec=self._limit_sec)
        self._systems.append(system)
        self._stack.callback(system.stop)
        try:
            system.start()
        except StartError:
            # The test fails by it, or expects it.
            system.errors_were_read = True
            raise
        return system

    def stop(self) -> None:
        """Stop what still runs."""
        self._stack.close()

    def fail_for_errors(self) -> None:
        """Fail the test if a behaviour raised, and the test did not look at it."""
        errors = [
            event
            for system in self._systems
            if not system.errors_were_read
            for event in system.raised()
        ]
        if errors and not self.has_failed:
            shown = '\n'.join(f'{render_event(each)}\n{each.value}' for each in errors)
            advice = "(a test that expects errors looks at them: 'system.errors')"
            pytest.fail(f'a behaviour raised an error {advice}:\n{shown}', pytrace=False)

    def sections(self) -> Iterator[tuple[str, str]]:
        """Yield titles and texts for the report of a failing test."""
        for system in self._systems:
            events = system.events[-_MOST_EVENTS:]
            texts = {
                'last events': [render_event(event) for event in events],
                'log': list(list_log(system.events))[-_MOST_LINES:],
                'errors of behaviours': [str(event.value) for event in system.raised()],
                'not repeatable': [str(notice) for notice in system.notices],
            }
            yield from ((f'composer: {title}', '\n'.join(text)) for title, text in texts.items())

    def _find(self, path: str | Path) -> Path:
        found = [folder / path for folder in self._folders if (folder / path).is_file()]
        if not found:
            tried = ' and in '.join(map(str, self._folders))
            message = f"there is no file '{path}' in {tried}"
            raise UsageError(message)
        return found[0]


def _format(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _refuse_errors(system: LoadedSystem) -> None:
    found = check_system(system, InterfaceCatalogue(), is_simulated=True)
    errors = [each for each in found if has_errors([each])]
    if errors:
        shown = '\n\n'.join(map(render_finding, errors))
        message = f'the system has errors:\n{shown}'
        raise ComposerError(message)
