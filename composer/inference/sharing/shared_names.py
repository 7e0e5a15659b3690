"""Which objects of modules a behaviour reads, and which it changes.

Names at the top of a module, attributes of its classes and functions, and what cached functions
return are what behaviours of several nodes share as long as these run in one process. Functions
that a behaviour calls, or hands on, count as its own. Nothing is imported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.inference.sharing.function_uses import FunctionReader, NameUses
from composer.inference.sharing.object_classes import ObjectClasses
from composer.inference.sharing.shared_functions import SharedFunctions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.inference.sharing.shared_functions import SharedName
    from composer.python_source.module_finder import ModuleFinder

# A behaviour that calls more is too large to follow.
_MOST_FUNCTIONS = 200


class SharedNames:
    """Reads what behaviours do with objects of modules."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._functions = SharedFunctions(finder)
        self._classes = ObjectClasses(self._functions)
        self._found: dict[tuple[str, str], NameUses] = {}

    def uses_of(self, module: str, function: str) -> NameUses:
        """Return what a function, or `Class.method`, reads and changes."""
        key = (module, function)
        if key not in self._found:
            self._found[key] = self._follow(module, function)
        return self._found[key]

    def find_touched(self, names: Iterable[SharedName], read: SharedName) -> SharedName | None:
        """Return the first of the names whose change is seen by who reads another."""
        return next((each for each in names if self._is_touched(each, read)), None)

    def _is_touched(self, changed: SharedName, read: SharedName) -> bool:
        if changed[0] != read[0]:
            return False
        if changed == read or read[1].startswith(f'{changed[1]}.'):
            return True
        # Who has an object has not read its attributes; what others do with it is unknown.
        is_inside = changed[1].startswith(f'{read[1]}.')
        return is_inside and self._classes.find(read) is None

    def _follow(self, module: str, function: str) -> NameUses:
        uses = NameUses()
        # The instance of a class is made with the node.
        owner = function.rpartition('.')[0]
        made = self._functions.find_functions(module, owner) if owner else ()
        pending = [*self._functions.find_functions(module, function), *made]
        seen = {(id(each.definition), each.bound) for each in pending}
        while pending and len(seen) < _MOST_FUNCTIONS:
            reader = FunctionReader(self._functions, self._classes, pending.pop(), uses)
            for each in reader.read():
                if (id(each.definition), each.bound) not in seen:
                    seen.add((id(each.definition), each.bound))
                    pending.append(each)
        return uses
