"""Read what behaviours do with their nodes, their helper functions included."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from composer.diagnostics import Span
from composer.python_source.local_names import find_parameter
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import FunctionKind, ModuleSource
from composer.python_source.node_use_reader import read_node_uses
from composer.python_source.node_uses import USED_NOUNS, NodeUses

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.bindings import Binding
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.modules import FunctionSource
    from composer.python_source.node_uses import NodePass, NodeUse

# How deep helpers of helpers are followed: recursive ones have no end.
_DEEPEST = 8
# How many uses of helpers are followed in all: those of functions that call each other multiply.
_MOST_FOLLOWED = 300_000


@dataclass(frozen=True, slots=True)
class FoundUse:
    """A use of an entity of the node, and where it is written."""

    use: NodeUse
    place: Span


@dataclass(frozen=True, slots=True)
class BehaviourUses:
    """All uses of a behaviour.

    Attributes:
        open_kinds: The kinds of which it may use more.
        reads_others: Whether it may read parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
    """

    found: tuple[FoundUse, ...] = ()
    open_kinds: frozenset[str] = USED_NOUNS
    reads_others: bool = True
    reaches_ros: bool = True


_UNKNOWN = BehaviourUses()
# Of a behaviour that does not exist, which another check reports.
_MISSING = BehaviourUses(reaches_ros=False)


class UseReader:
    """Reads what behaviours do with their nodes, each function once."""

    def __init__(self, modules: ModuleFinder) -> None:
        self._modules = modules
        self._read: dict[tuple[object, ...], BehaviourUses] = {}
        self._followed = 0

    def uses_of(self, binding: Binding) -> BehaviourUses:
        """Return what a behaviour does with its node; if that is unknown, all kinds are open."""
        module = self._modules.find(binding.behaviour.module)
        function = binding.behaviour.function
        return self._uses(module, function, 0, len(binding.parameters), ())

    def _uses(
        self, module: object, name: str, position: int | str, given: int, callers: tuple[str, ...]
    ) -> BehaviourUses:
        if isinstance(module, MissingModule):
            return _MISSING
        if not isinstance(module, ModuleSource) or module.path is None:
            return _UNKNOWN
        if name in module.imports:
            home, _, original = module.imports[name].rpartition('.')
            if not home or len(callers) > _DEEPEST:
                return _UNKNOWN
            callers = (*callers, name)
            return self._uses(self._modules.find(home), original, position, given, callers)
        source = module.functions.get(name)
        caller = f'{module.path}:{name}'
        if source is None and not (module.is_open or name in module.constants):
            return _MISSING
        if source is None or len(callers) > _DEEPEST:
            return _UNKNOWN
        key = (caller, position, given)
        if key not in self._read:
            self._read[key] = self._gather(module, source, position, given, (*callers, caller))
        return self._read[key]

    def _gather(
        self,
        module: ModuleSource,
        source: FunctionSource,
        position: int | str,
        given: int,
        callers: tuple[str, ...],
    ) -> BehaviourUses:
        own = _read(source, position, given, module.texts)
        file = module.place_of(1).source
        found = [FoundUse(use, Span(file, use.line, use.column, use.length)) for use in own.uses]
        open_kinds, reads_others = own.open_kinds, own.reads_others
        reaches_ros = own.reaches_ros
        for passed in dict.fromkeys(own.passes):
            inner = self._uses(module, passed.function, passed.position, 0, callers)
            self._followed += len(inner.found)
            if self._followed > _MOST_FOLLOWED:
                return _UNKNOWN
            is_late = self._is_coroutine(module, passed.function) and not passed.is_awaited
            found += [_as_passed(each, passed, is_late=is_late) for each in inner.found]
            open_kinds |= inner.open_kinds
            reads_others |= inner.reads_others
            reaches_ros |= inner.reaches_ros
        # Each use once, or functions that call each other often would take forever.
        return BehaviourUses(tuple(dict.fromkeys(found)), open_kinds, reads_others, reaches_ros)

    def _is_coroutine(self, module: ModuleSource, name: str) -> bool:
        source = module.functions.get(name)
        return source is not None and source.kind in (None, FunctionKind.COROUTINE)


def _read(
    source: FunctionSource, position: int | str, given: int, texts: Mapping[str, str]
) -> NodeUses:
    """Return what a function does itself.

    Args:
        given: The number of its positional parameters whose values no file sets; 0 for a helper.
    """
    if source.definition is None:
        return NodeUses()
    name = find_parameter(source.definition, position)
    if name is None:
        return NodeUses()
    arguments = source.definition.args
    positional = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
    return read_node_uses(source.definition, name, {name, *positional[:given]}, texts)


def _as_passed(found: FoundUse, passed: NodePass, *, is_late: bool) -> FoundUse:
    if passed.is_certain and not passed.is_guarded and passed.waits and not is_late:
        return found
    use = found.use
    use = replace(
        use,
        is_certain=use.is_certain and passed.is_certain,
        is_guarded=use.is_guarded or passed.is_guarded,
        waits=use.waits and passed.waits and not is_late,
    )
    return FoundUse(use, found.place)
