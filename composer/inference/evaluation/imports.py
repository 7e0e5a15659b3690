"""Imports: what they store, and whether it exists."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    import ast

    from composer.python_source.modules import ModuleSource

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

        Another check looks at those at the top of a module, and at what is not of the project.
        """
        if statement in module.body:
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
        if home is None:
            return self.external(full_name)
        if not self.is_module_in(home, inner):
            place = Place(module, next(each for each in statement.names if _stored(each) == name))
            known = self._evaluator.run.modules.top(home).statements
            message = f"there is no '{inner}' in {home.source.name}"
            self._evaluator.run.report('missing-module', place, message, suggest(inner, known))
        return UNKNOWN

    def external(self, full_name: str) -> Value:
        """Return what a full name stands for that is not of the project."""
        if full_name in _OF_THE_MACHINE:
            return CHOSEN
        if full_name in CONSTANTS:
            return constant(CONSTANTS[full_name])
        # 'rclpy.action' holds no actions.
        interface = None if full_name.startswith('rclpy.') else find_interface(full_name)
        if interface is None:
            return External(full_name)
        whole, _ = split_part(interface)
        catalogue = self._evaluator.run.types.catalogue
        is_known = whole.partition('/')[0] in catalogue.packages()
        return UNKNOWN if is_known and not catalogue.has(whole) else MessageClass(interface)

    def is_module_in(self, package: ModuleSource, name: str) -> bool:
        """Return whether a package has a module of this name."""
        path = package.path
        if path is None or path.name != '__init__.py':
            return False
        return (path.parent / f'{name}.py').exists() or (path.parent / name).is_dir()


def _stored(alias: ast.alias) -> str:
    """Return the name that an import stores."""
    return alias.asname or alias.name.partition('.')[0]
