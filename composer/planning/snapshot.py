"""A system as its files and the sources of its behaviours say it at one time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from composer.diagnostics import Span
    from composer.language.specs import BehaviourSpec, SystemSpec
    from composer.ros_parameters.file_reader import ParameterEntry
    from composer.yaml_text.positions import DataPath, SourceMap


@dataclass(slots=True)
class Snapshot:
    """What two readings of a system are compared by.

    Attributes:
        positions: Where the parts of `spec` are written.
        code: For each module that a behaviour is in, and each of the project that such a one
            imports, the digest of its source and of all that it imports itself, by its name.
        sources: The texts of these modules.
        classes: The digest of each class of behaviours, with all that it uses, by `module:Class`.
        definitions: The text of each definition file of the declared interface packages, by the
            package and the path in its folder.
        overrides: What the parameter files of nodes say of their parameters, by the nodes' full
            names and the parameters' names.
        prefixes: Where the interface packages are that were built for the system.
        generators: The behaviours of timers that are generators.
        set_live: The parameters that somebody has set while the system ran, by the nodes' full
            names; `None` if it does not run.
        read_at_start: Where values are written that are read from files and of commands.
        hidden: What `composer.confidential` hides of the system.
    """

    spec: SystemSpec
    positions: SourceMap
    code: Mapping[str, str]
    sources: Mapping[str, str]
    definitions: Mapping[tuple[str, str], str]
    overrides: Mapping[str, Mapping[str, ParameterEntry]]
    prefixes: tuple[str, ...] = ()
    generators: Collection[str] = frozenset()
    set_live: Mapping[str, Collection[str]] | None = None
    read_at_start: Collection[Span] = frozenset()
    hidden: Mapping[str, str] = field(default_factory=dict)
    classes: Mapping[str, str] = field(default_factory=dict)

    def without(self, nodes: Collection[str]) -> Snapshot:
        """Return it without the nodes of these full names."""
        kept = {key: each for key, each in self.spec.nodes.items() if each.full_name not in nodes}
        return replace(self, spec=replace(self.spec, nodes=kept)) if nodes else self

    def is_read_at_start(self, path: DataPath) -> bool:
        """Return whether the value at a path is read when the system starts."""
        return bool(self.read_at_start) and self.positions.value(path) in self.read_at_start

    def code_of(self, behaviour: BehaviourSpec) -> str | None:
        """Return the digest of the code of a behaviour: of its module, or of its class."""
        if behaviour.class_name:
            return self.classes.get(f'{behaviour.module}:{behaviour.class_name}')
        return self.code.get(behaviour.module)

    def stale_modules(self, other: Snapshot) -> set[str]:
        """Return the modules whose source, or what they import, differs from `other`'s."""
        names = {*self.code, *other.code}
        return {name for name in names if self.code.get(name) != other.code.get(name)}
