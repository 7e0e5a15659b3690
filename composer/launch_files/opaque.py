"""`OpaqueFunction`: run, to see what it returns, and which arguments that depends on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.launch_files.marks import run_marked
from composer.launch_files.parameters import NewFile
from composer.launch_files.results import LaunchError
from composer.launch_files.substitutions import Resolver, private
from composer.launch_files.texts import Computed, unmarked

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from composer.launch_files.place import Place


class OpaqueRuns:
    """Runs the functions of one launch description.

    Args:
        place: Where it is read.
        read: Reads entities at a place.
    """

    def __init__(self, place: Place, read: Callable[[Place, Iterable[Any]], None]) -> None:
        self._place = place
        self._read = read

    def run(self, entity: Any) -> None:
        """Add what a function returns."""
        place = self._place
        best, fixed = run_marked(
            place.scope.configurations, lambda marks: self._attempt(entity, marks), _outcome
        )
        place.adopt(best)
        if fixed:
            place.fix(fixed)
            shown = ', '.join(fixed)
            place.remark(f'OpaqueFunction was resolved: what it returns depends on {shown}')

    def _attempt(self, entity: Any, marks: frozenset[str]) -> tuple[Place, list[str]]:
        """Return a reader that has read what the function returns, and which names it has read."""
        fork = self._place.forked()
        context = fork.loader.context
        fork.scope.fill(context, marks)
        before = dict(context.launch_configurations)
        function = private(entity, 'function')
        arguments = private(entity, 'args') or ()
        keywords = private(entity, 'kwargs') or {}
        with fork.loader.reading() as read:
            try:
                returned = function(context, *arguments, **keywords)
            except ComposerError:
                raise
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                message = f'{fork.origin}: {function.__name__}: {type(error).__name__}: {error}'
                raise LaunchError(message) from error
        self._take_changes(fork, before)
        self._read(fork, returned or ())
        return fork, read

    @staticmethod
    def _take_changes(fork: Place, before: dict[str, Any]) -> None:
        """Take over the configurations that the function has set itself."""
        for name, value in fork.loader.context.launch_configurations.items():
            if isinstance(value, str) and before.get(name) is not value:
                fork.scope.configurations[name] = Resolver(fork).text(value)


def _outcome(place: Place) -> list[Any]:
    """Return what was read, with the values of marks and expressions in place."""
    return [
        (entry.section, unmarked(entry.name), _plain(entry.data), entry.holds)
        for entry in place.result.entries
    ]


def _plain(data: Any) -> Any:
    if isinstance(data, NewFile):
        return _plain(data.data)
    if isinstance(data, dict):
        return {_plain(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_plain(item) for item in data]
    return data.value if isinstance(data, Computed) else data
