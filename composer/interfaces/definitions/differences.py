"""Does a folder define what the installed package of that name has?

Fields, their types and order, defaults and constants count; comments do not. An installed package
may have more interfaces than the folder.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from difflib import unified_diff
from pathlib import Path

from composer.errors import ComposerError
from composer.interfaces.definitions.installed_definitions import describe_package
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.interfaces.definitions.statements import SEPARATOR
from composer.interfaces.descriptions import (
    ActionDescription,
    InterfaceDescription,
    MessageDescription,
    ServiceDescription,
)


@dataclass(frozen=True, slots=True)
class Difference:
    """An interface that a folder defines otherwise than the installed package.

    Attributes:
        name: full name of the interface.
        diff: what changes from the installed definition to the folder's, in unified form.
    """

    name: str
    diff: str


class DefinitionsDifferError(ComposerError):
    """A folder's definitions are not those of the installed package.

    Attributes:
        differences: one for each interface.
    """

    def __init__(
        self,
        definitions: PackageDefinitions,
        prefix: Path,
        differences: list[Difference],
    ) -> None:
        """Show all differences."""
        diffs = '\n'.join(difference.diff for difference in differences)
        super().__init__(
            f'{definitions.package} is installed in {prefix}, and {definitions.folder} defines it '
            f'otherwise:\n{diffs}',
            help='use the installed definitions, or give the package in the folder another name',
        )
        self.differences = tuple(differences)


def require_same(definitions: PackageDefinitions, prefix: Path) -> None:
    """Refuse a folder that does not define what is installed.

    Args:
        definitions: of the folder, without faults.
        prefix: where the package is installed.

    Raises:
        DefinitionsDifferError: it defines something else.
    """
    differences = compare_definitions(definitions, prefix)
    if differences:
        raise DefinitionsDifferError(definitions, prefix, differences)


def compare_definitions(definitions: PackageDefinitions, prefix: Path) -> list[Difference]:
    """Compare a folder's definitions with the installed package's.

    Args:
        definitions: of the folder, without faults.
        prefix: where the package is installed.
    """
    installed = describe_package(definitions.package, prefix)
    return list(_compare(definitions, installed, prefix))


def _compare(
    definitions: PackageDefinitions,
    installed: dict[str, InterfaceDescription],
    prefix: Path,
) -> Iterator[Difference]:
    share = prefix / 'share'
    for name, interface in definitions.interfaces.items():
        wanted = _render(interface)
        found = _render(installed[name]) if name in installed else []
        if wanted != found:
            _, kind, stem = name.split('/')
            lines = unified_diff(
                found,
                wanted,
                n=1,
                lineterm='',
                fromfile=str(share / f'{name}.{kind}') if name in installed else '(not installed)',
                tofile=str(definitions.folder / kind / f'{stem}.{kind}'),
            )
            yield Difference(name, '\n'.join(lines))


def _render(interface: InterfaceDescription) -> list[str]:
    """Write an interface in the notation of definition files, without comments."""
    match interface:
        case MessageDescription():
            parts: tuple[MessageDescription, ...] = (interface,)
        case ServiceDescription():
            parts = (interface.request, interface.response)
        case ActionDescription():
            parts = (interface.goal, interface.result, interface.feedback)
    lines = []
    for part in parts:
        lines += [SEPARATOR, *_render_message(part)]
    return lines[1:]


def _render_message(message: MessageDescription) -> Iterator[str]:
    for constant in message.constants:
        yield f'{constant.type} {constant.name}={constant.value!r}'
    for field in message.fields:
        # A char is described as a uint8, which it is.
        char = field.type.kind == 'char'
        field_type = replace(field.type, kind='uint8') if char else field.type
        default = '' if field.default is None else f' {field.default!r}'
        yield f'{field_type} {field.name}{default}'
