"""Imports: what they store, and whether it exists."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, cast

from composer.inference.evaluation.library.known_functions import CONSTANTS
from composer.inference.evaluation.part import Part
from composer.inference.message_types import split_part
from composer.inference.values import (
    CHOSEN,
    UNKNOWN,
    External,
    MessageClass,
    Place,
    ProjectModule,
    Value,
    constant,
)
from composer.python_source.annotations import find_interface
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.interfaces.catalogue import InterfaceKind
    from composer.python_source.modules import ModuleSource

_FOLDERS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')


# On what these say, branches are taken or not.
_OF_THE_MACHINE = {
    'os.environ',
    'os.name',
    'sys.argv',
    'sys.platform',
    'sys.version_info',
    'typing.TYPE_CHECKING',
}


class Imports(Part):
    """Evaluates imports."""

    def imported(
        self, module: ModuleSource, statement: ast.Import | ast.ImportFrom, name: str
    ) -> Value:
        """Return what an import stores under a name.

        Another check looks at those at the top of a module, but for names of Composer.
        """
        of_composer = isinstance(statement, ast.ImportFrom) and statement.module == 'composer'
        if statement in module.body and not of_composer:
            with self._evaluator.run.silence():
                return self._imported(module, statement, name)
        return self._imported(module, statement, name)

    def _imported(
        self, module: ModuleSource, statement: ast.Import | ast.ImportFrom, name: str
    ) -> Value:
        full_name = self._evaluator.run.modules.imported(module, statement, name)
        if not full_name:
            return UNKNOWN
        home, inner = self._evaluator.run.modules.split(full_name)
        if home is not None:
            if not inner:
                return ProjectModule(home)
            if self._evaluator.run.modules.has_name(home, inner):
                return self._evaluator.top_value(home, inner)
        place = Place(module, next(each for each in statement.names if _stored(each) == name))
        if home is not None:
            if not self.is_module_in(home, inner):
                known = self._evaluator.run.modules.top(home).statements
                self._report_import(
                    place, f"there is no '{inner}' in {home.source.name}", known, inner
                )
            return UNKNOWN
        return self.external(full_name, place)

    def external(self, full_name: str, place: Place) -> Value:
        """Return what a full name stands for that is not of the project."""
        if full_name in _OF_THE_MACHINE:
            return CHOSEN
        if full_name in CONSTANTS:
            return constant(CONSTANTS[full_name])
        # 'rclpy.action' holds no actions.
        interface = None if full_name.startswith('rclpy.') else find_interface(full_name)
        if interface is None:
            package, _, name = full_name.partition('.')
            if package == 'composer':
                public = self._evaluator.run.modules.public_names('composer')
                is_name = bool(name) and '.' not in name and not name.islower()
                if is_name and public and name not in public:
                    self._report_import(place, f"composer has no '{name}'", public, name)
                    return UNKNOWN
                return External(full_name)
            catalogue = self._evaluator.run.types.catalogue
            folder = name.partition('.')[0]
            is_public = folder.isidentifier() and not folder.startswith('_')
            if is_public and folder not in _FOLDERS and package in catalogue.packages():
                folders = [each for each in _FOLDERS if catalogue.names(each, package)]
                self._report_import(place, f"{package} has no '{folder}'", folders, folder)
            return External(full_name)
        whole, _ = split_part(interface)
        package, kind, name = whole.split('/')
        catalogue = self._evaluator.run.types.catalogue
        if package in catalogue.packages() and not catalogue.has(whole):
            names = catalogue.names(cast('InterfaceKind', kind), package)
            known = [each.rpartition('/')[2] for each in names]
            several = [
                *(f'{other}/{kind}/{name}' for other in catalogue.packages()),
                *(f'{package}/{other}/{name}' for other in _FOLDERS),
            ]
            elsewhere = [each for each in several if catalogue.has(each)]
            if elsewhere:
                known = []
            self._report_import(
                place, f"{package}.{kind} has no '{name}'", known, name, elsewhere[:1]
            )
            return UNKNOWN
        return MessageClass(interface)

    def _report_import(
        self,
        place: Place,
        message: str,
        known: Iterable[str],
        name: str,
        elsewhere: Iterable[str] = (),
    ) -> None:
        found = [each.replace('/', '.') for each in elsewhere]
        help_text = f"did you mean '{found[0]}'?" if found else suggest(name, known)
        self._evaluator.run.report('missing-module', place, message, help_text)

    def is_module_in(self, package: ModuleSource, name: str) -> bool:
        """Return whether a package has a module of this name."""
        path = package.path
        if path is None or path.name != '__init__.py':
            return False
        return (path.parent / f'{name}.py').exists() or (path.parent / name).is_dir()


def _stored(alias: ast.alias) -> str:
    """Return the name that an import stores."""
    return alias.asname or alias.name.partition('.')[0]
