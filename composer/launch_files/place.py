"""The place in a launch file that is being read: what holds there, and what was found so far."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from composer.expressions import written_in_expression
from composer.launch_files.results import Argument, Entry, Imported, LaunchError
from composer.launch_files.surroundings import Scope
from composer.launch_files.texts import Computed, Text, joined, one

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.launch_files.loading import Loader


class Place:
    """A place in a launch file.

    Args:
        given: The arguments that the import was given.

    Attributes:
        origin: The line, as in `line 42 of x.launch.py`.
        depth: How many launch files include each other here.
    """

    def __init__(self, loader: Loader, given: dict[str, str]) -> None:
        self.loader = loader
        self.given = given
        self.scope = Scope()
        self.result = Imported()
        self.origin = ''
        self.depth = 0

    def remark(self, text: str) -> None:
        """Note what cannot be kept, with the line that it comes from."""
        remark = f'{self.origin}: {text}' if self.origin else text
        if remark not in self.result.remarks:
            self.result.remarks.append(remark)

    def declare(self, argument: Argument) -> Text:
        """Declare an argument, and return its value.

        Raises:
            LaunchError: It needs a value to be imported with.
        """
        name, default = argument.name, argument.default
        text = self.given.get(name) or (default.text if default else None)
        if text is None and name not in self.given:
            text = next(iter(argument.choices), None)
        if text is None and name not in self.given:
            message = f"{self.origin}: the launch file requires the argument '{name}'"
            raise LaunchError(message, help=f'give it a value: {name}:=…')
        argument.given = self.given.get(name, text or '')
        self.result.arguments.setdefault(name, argument)
        return one(written_in_expression(name), argument.given)

    def fix(self, names: Iterable[str]) -> None:
        """Note that the value of a configuration decides what foreign code does."""
        values = map(self.scope.configurations.get, names)
        self.result.freeze(*(each for each in values if isinstance(each, Text)))

    def add(self, section: str, name: str, data: dict[str, Any], action: Any) -> Entry:
        """Add an entry to the system."""
        taken = {entry.name for entry in self.result.entries}
        plain = name or 'process'
        number = 2
        while name in taken or not name:
            name = f'{plain}_{number}'
            number += 1
        if self.scope.delay is not None:
            own = data.get('delay', 0.0)
            code = f'{number_code(self.scope.delay)} + {own}'
            total = one(code, str(float(self.scope.delay.text) + own), 'number')
            data['delay'] = number_value(total if own else self.scope.delay)
            if self.scope.delay.is_constant:
                data['delay'] = float(total.text)
        entry = Entry(
            section,
            name,
            data,
            action,
            self.origin,
            self.scope.when,
            self.scope.holds,
            list(self.scope.waits),
            dict(self.scope.environment),
        )
        self.result.entries.append(entry)
        return entry

    def forked(self) -> Place:
        """Return the same place with results of its own."""
        other = Place(self.loader, self.given)
        other.scope = Scope(
            {
                name: list(value) if isinstance(value, list) else value
                for name, value in self.scope.configurations.items()
            },
            dict(self.scope.environment),
            list(self.scope.conditions),
            list(self.scope.waits),
            self.scope.delay,
            self.scope.file,
            list(self.scope.configuration_stack),
            list(self.scope.environment_stack),
        )
        other.result.arguments = {
            name: replace(each) for name, each in self.result.arguments.items()
        }
        other.result.entries = list(self.result.entries)
        other.result.files = list(self.result.files)
        other.origin = self.origin
        other.result.started = self.result.started
        other.depth = self.depth
        return other

    def adopt(self, other: Place) -> None:
        """Go on as a place that was forked."""
        self.scope.configurations = other.scope.configurations
        self.scope.environment = other.scope.environment
        self.result.arguments = other.result.arguments
        self.result.entries = other.result.entries
        self.result.files = other.result.files
        for remark in other.result.remarks:
            if remark not in self.result.remarks:
                self.result.remarks.append(remark)


def join_namespaces(outer: Any, own: Text) -> Text:
    """Return a namespace in another one, as launch joins them."""
    if not isinstance(outer, Text) or not outer.parts:
        return own
    if own.is_constant:
        if own.text.startswith('/') or not own.text:
            return own if own.text else outer
        return joined((outer, own), '' if outer.text == '/' else '/')
    inside = joined((outer, own), '/')
    is_absolute = f"{own.code}.startswith('/')"
    relative = f'{inside.code} if {own.code} else {outer.code}'
    code = f'({own.code} if {is_absolute} else {relative})'
    text = own.text if own.text.startswith('/') else inside.text if own.text else outer.text
    return one(code, text)


def number_code(value: Text) -> str:
    """Return an expression for a text that is a number."""
    if value.is_constant:
        return value.text
    return value.code if value.kind == 'number' else f'({value.code} | float)'


def number_value(value: Text) -> Any:
    """Return the number that a text is, or an expression for it."""
    number = float(value.text)
    return number if value.is_constant else Computed(f'{{{{ {number_code(value)} }}}}', number)
