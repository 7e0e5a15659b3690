"""Compare the definitions in a folder with those of the installed package of that name.

Fields, their types and order, defaults and constants count; comments do not. An installed package
may have more interfaces than the folder.
"""

import re
from collections.abc import Iterator
from difflib import unified_diff
from pathlib import Path

from composer.errors import ComposerError
from composer.interfaces.definitions.installed_definitions import describe_package
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.interfaces.definitions.rendering import render_definition
from composer.interfaces.descriptions import InterfaceDescription
from composer.records import record

# Type descriptions have no char: they describe such a field as the uint8 that it is.
_CHAR_FIELD = re.compile(r'^char(?!\S* \w+=)')


@record
class Difference:
    """An interface that a folder defines differently from the installed package.

    Attributes:
        name: full name of the interface.
        diff: the unified diff from the installed definition to that in the folder.
    """

    name: str
    diff: str


class DefinitionsDifferError(ComposerError):
    """The definitions in a folder are not those of the installed package.

    Attributes:
        differences: one for each interface.
    """

    def __init__(
        self,
        definitions: PackageDefinitions,
        prefix: Path,
        differences: list[Difference],
    ) -> None:
        """Show all differences in the message."""
        diffs = '\n'.join(difference.diff for difference in differences)
        super().__init__(
            f'{definitions.package} is installed in {prefix}, and {definitions.folder} defines it '
            f'differently:\n{diffs}',
            help='use the installed definitions, or give the package in the folder another name',
        )
        self.differences = tuple(differences)


def require_same(definitions: PackageDefinitions, prefix: Path) -> None:
    """Check that a folder defines what is installed.

    Args:
        definitions: of the folder, without errors.
        prefix: where the package is installed.

    Raises:
        DefinitionsDifferError: it does not.
    """
    differences = compare_definitions(definitions, prefix)
    if differences:
        raise DefinitionsDifferError(definitions, prefix, differences)


def compare_definitions(definitions: PackageDefinitions, prefix: Path) -> list[Difference]:
    """Compare a folder's definitions with the installed package's.

    Args:
        definitions: of the folder, without errors.
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
    lines = render_definition(interface, comments=False)
    return [_CHAR_FIELD.sub('uint8', line) for line in lines]
