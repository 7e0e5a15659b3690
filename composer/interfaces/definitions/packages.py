"""The definitions of several packages: read, checked against each other, and put in order."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.package_folder import (
    PackageDefinitions,
    ReadingBudget,
    TypeReference,
    load_definitions,
)
from composer.interfaces.definitions.statement_rules import list_primitive_types, translate_type
from composer.interfaces.descriptions import ActionDescription, ServiceDescription
from composer.spelling import did_you_mean, find_nearest

# The packages that every service and every action uses (rosidl_parser.definition).
SERVICE_PACKAGES = frozenset({'builtin_interfaces', 'service_msgs'})
ACTION_PACKAGES = SERVICE_PACKAGES | {'action_msgs', 'unique_identifier_msgs'}

# Where to look for a message that is written without its package.
_COMMON = ('builtin_interfaces', 'std_msgs', 'geometry_msgs', 'sensor_msgs', 'nav_msgs')


class DefinitionsError(ComposerError):
    """Interface definitions have errors.

    Attributes:
        diagnostics: all of them.
    """

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        """List all findings."""
        super().__init__('\n'.join(map(_format, diagnostics)))
        self.diagnostics = tuple(diagnostics)


def _format(diagnostic: Diagnostic) -> str:
    place = diagnostic.span or diagnostic.file
    text = f'{place}: error[{diagnostic.rule}]: {diagnostic.message}'
    return f'{text}\n  help: {diagnostic.help}' if diagnostic.help else text


def load_packages(
    folders: Mapping[str, Path],
    catalogue: InterfaceCatalogue,
    listed: Mapping[str, Iterable[str]] | None = None,
) -> list[PackageDefinitions]:
    """Read the definitions of packages, each in order after those that it uses.

    Args:
        folders: the folder of each package's definitions, by its name.
        catalogue: what is installed.
        listed: what alone is needed of a package, such as `msg/Name`, beside the messages that
            this and other packages use.

    Raises:
        ParserMissingError: `rosidl_adapter` is not installed.
        DefinitionsError: they have errors, alone or together.
    """
    budget = ReadingBudget()
    packages = []
    for package, folder in folders.items():
        packages.append(load_definitions(package, folder, budget))
        if budget.is_spent:
            raise DefinitionsError([each for one in packages for each in one.diagnostics])
    if listed:
        packages = _keep_listed(packages, listed)
    diagnostics = check_definitions(packages, catalogue)
    if diagnostics:
        raise DefinitionsError(diagnostics)
    return order_packages(packages)


def _keep_listed(
    packages: Sequence[PackageDefinitions], listed: Mapping[str, Iterable[str]]
) -> list[PackageDefinitions]:
    """Return packages without the interfaces that are neither listed nor used by others."""
    used: dict[str, list[str]] = {}
    for reference in (reference for package in packages for reference in package.references):
        # Parts of services and actions are called `Name_Request` and the like.
        package, kind, name = reference.user.split('/')
        user = f'{package}/{kind}/{name.partition("_")[0]}'
        used.setdefault(user, []).append(reference.message.replace('/', '/msg/'))
    names = {name for package in packages for name in package.names().values()}
    pending = [name for name in names if name.partition('/')[0] not in listed]
    pending += [f'{package}/{name}' for package in listed for name in listed[package]]
    kept: set[str] = set()
    while pending:
        name = pending.pop()
        if name not in kept:
            kept.add(name)
            pending += used.get(name, ())
    return [package.without(frozenset(names - kept)) for package in packages]


def used_packages(definitions: PackageDefinitions) -> frozenset[str]:
    """Return the other packages whose messages a package uses."""
    packages = {reference.message.partition('/')[0] for reference in definitions.references}
    for interface in definitions.interfaces.values():
        if isinstance(interface, ServiceDescription):
            packages |= SERVICE_PACKAGES
        elif isinstance(interface, ActionDescription):
            packages |= ACTION_PACKAGES
    return frozenset(packages - {definitions.package})


def check_definitions(
    packages: Sequence[PackageDefinitions],
    catalogue: InterfaceCatalogue,
) -> list[Diagnostic]:
    """Return the errors in packages, each by itself and together, in order of position.

    Args:
        packages: all those in folders; they count before installed ones.
        catalogue: what is installed.
    """
    known = _Messages(packages, catalogue)
    diagnostics = [each for package in packages for each in package.diagnostics]
    for reference in (reference for package in packages for reference in package.references):
        package, _, name = reference.message.partition('/')
        messages = known.of(package)
        if messages is None:
            diagnostics.append(_unknown_package(reference, known.packages()))
        elif name not in messages:
            diagnostics.append(_unknown_message(reference, known))
    if not diagnostics:
        diagnostics = [*_check_containment(packages), *_check_package_order(packages)]
    return sorted(diagnostics, key=lambda each: each.sort_key)


class _Messages:
    """The known messages, by package."""

    def __init__(
        self,
        packages: Sequence[PackageDefinitions],
        catalogue: InterfaceCatalogue,
    ) -> None:
        self._catalogue = catalogue
        self._by_package: dict[str, frozenset[str] | None] = {
            package.package: package.messages() for package in packages
        }

    def packages(self) -> set[str]:
        """Return the packages with interfaces."""
        defined = (name for name, messages in self._by_package.items() if messages is not None)
        return {*defined, *self._catalogue.packages()}

    def of(self, package: str) -> frozenset[str] | None:
        """Return the messages of a package; None if there is no such package."""
        if package not in self._by_package:
            names = self._catalogue.names('msg', package)
            installed = names or package in self._catalogue.packages()
            messages = frozenset(name.rpartition('/')[2] for name in names)
            self._by_package[package] = messages if installed else None
        return self._by_package[package]


def order_packages(packages: Iterable[PackageDefinitions]) -> list[PackageDefinitions]:
    """Sort packages so that each comes after those that it uses.

    Args:
        packages: without errors, as `check_definitions` finds them.
    """
    by_name = {package.package: package for package in packages}
    graph = {name: used_packages(package) & by_name.keys() for name, package in by_name.items()}
    return [by_name[name] for name in TopologicalSorter(graph).static_order()]


def _unknown_package(reference: TypeReference, options: Iterable[str]) -> Diagnostic:
    package, _, name = reference.message.partition('/')
    nearest = find_nearest(package, options)
    install = 'install it, or name the folder of its definitions under interfaces'
    return diagnostic_at(
        reference.span,
        'unknown-package',
        f'there is no interface package {package!r}',
        help=did_you_mean(nearest and f'{nearest}/{name}', install),
    )


def _unknown_message(reference: TypeReference, known: _Messages) -> Diagnostic:
    package, _, name = reference.message.partition('/')
    messages = known.of(package) or frozenset()
    if '/' in reference.span.text:
        nearest = find_nearest(name, messages)
        return diagnostic_at(
            reference.span,
            'unknown-type',
            f'{package} has no message {name!r}',
            help=did_you_mean(nearest and f'{package}/{nearest}'),
        )
    elsewhere = (f'{other}/{name}' for other in _COMMON if name in (known.of(other) or ()))
    nearest = (
        next(elsewhere, None)
        or translate_type(name)
        or find_nearest(name, [*messages, *list_primitive_types()])
    )
    form = 'messages of other packages are written package/Message'
    return diagnostic_at(
        reference.span,
        'unknown-type',
        f'there is no type {name!r}: {package} has no such message',
        help=did_you_mean(nearest, form),
    )


def _check_containment(packages: Sequence[PackageDefinitions]) -> Iterator[Diagnostic]:
    """Find messages that contain themselves."""
    references = {
        (reference.user, reference.message.replace('/', '/msg/')): reference
        for package in packages
        for reference in package.references
    }
    graph: dict[str, set[str]] = {}
    for user, used in references:
        graph.setdefault(user, set()).add(used)
    for cycle in _find_cycle(graph):
        reference = references[cycle[1], cycle[0]]
        message = f'a message contains itself: {" in ".join(cycle)}'
        yield diagnostic_at(reference.span, 'endless-type', message)


def _check_package_order(packages: Sequence[PackageDefinitions]) -> Iterator[Diagnostic]:
    """Find packages that use each other: neither could be built first."""
    graph = {package.package: used_packages(package) for package in packages}
    for cycle in _find_cycle(graph):
        reference = next(
            reference
            for package in packages
            if package.package == cycle[1]
            for reference in package.references
            if reference.message.startswith(f'{cycle[0]}/')
        )
        message = f'packages use each other: {" by ".join(cycle)}'
        yield diagnostic_at(reference.span, 'circular-packages', message)


def _find_cycle(graph: Mapping[str, Iterable[str]]) -> Iterator[list[str]]:
    """Find at most one cycle; each of its names is used by the one after it."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        yield error.args[1]
