"""The place in a launch file that is being read: what holds there, and what was found so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from composer.errors import ComposerError
from composer.expressions import written_in_expression
from composer.launch_files.results import Argument, Entry, Imported, LaunchError, Origin
from composer.launch_files.surroundings import Scope
from composer.launch_files.texts import Computed, Text, joined, one

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.launch_files.loading import Loader

Result = TypeVar('Result')


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
        self.result = Imported(given=given)
        self.origin = Origin()
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

    def declare_rest(self) -> None:
        """Declare the arguments of the import that nothing declares: code may have read them."""
        self.origin = Origin()
        for name in self.given:
            if name not in self.result.arguments:
                self.remark(f"no action declares the argument '{name}'")
                self.declare(Argument(name, None, fixed=True))

    def resolve(self, what: str, code: Callable[[], Result]) -> Result:
        """Run code of the launch file, and fix the arguments that it reads.

        Raises:
            LaunchError: It fails.
        """
        context = self.loader.context
        self.scope.fill(context, self.given)
        with self.loader.reading() as read:
            try:
                result = code()
            except ComposerError:
                raise
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                message = f'{self.origin}: {what}: {type(error).__name__}: {error}'
                raise LaunchError(message) from error
        values = map(self.scope.configurations.get, read)
        self.freeze(what, *(value for value in values if isinstance(value, Text)))
        return result

    def freeze(self, what: str, *used: Text | str) -> None:
        """Keep the values of the arguments in texts and expressions: something depends on them.

        Args:
            what: What depends on them.
        """
        fixed = [f'{each.name}:={each.given}' for each in self.result.freeze(*used)]
        if fixed:
            self.remark(f'{what} was resolved for {", ".join(fixed)}')

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
