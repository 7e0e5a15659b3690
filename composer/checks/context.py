"""What checks are given, and how they report."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from composer.ament import find_meant_package
from composer.checks.connections.topology import Topology, add_created, build_topology
from composer.diagnostics import Related, diagnostic_at
from composer.interfaces.message_types import MessageTypes
from composer.language.bindings import Binding, exit_bindings, node_bindings
from composer.language.specs import DeclaredEndSpec
from composer.node_uses.behaviour_reader import BehaviourReader
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Unpack

    from composer.diagnostics import Diagnostic, Remarks, Span
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.interfaces.declared_packages import DeclaredPackages
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import EndSpec, NodeSpec, SystemSpec
    from composer.node_uses.reading import Reading
    from composer.python_source.module_finder import ModuleFinder
    from composer.yaml_text.positions import DataPath


@record
class CheckContext:
    """A system, and what its checks compare it with.

    Attributes:
        interfaces: The types of the system, and the errors in the packages that it declares.
    """

    system: LoadedSystem
    spec: SystemSpec
    interfaces: DeclaredPackages
    modules: ModuleFinder

    def on_host(self, host: str) -> CheckContext:
        """Return the context of the part that a host runs."""
        return replace(self, spec=self.spec.on_host(host))

    @cached_property
    def topology(self) -> Topology:
        """What connects the nodes."""
        topology = build_topology(self.system, self.spec, self.has_real_type)
        for node in self.spec.nodes.values():
            for reading in self.readings(node):
                if reading.created:
                    topology = add_created(topology, node, reading.created)
        return topology

    @cached_property
    def behaviours(self) -> BehaviourReader:
        """What reads the behaviours."""
        # A copy asks, so that no circle keeps this context until garbage is collected: for a
        # large system that would stop its callbacks for long, after each edit.
        asked = replace(self)
        return BehaviourReader(self.modules, asked.has_real_type)

    @cached_property
    def incomplete(self) -> set[DataPath]:
        """The nodes and other entries that lack something, because it has an error."""
        return {path[:2] for path in self.system.dropped}

    @cached_property
    def types(self) -> MessageTypes:
        """What the messages of the system have."""
        return MessageTypes(self.catalogue)

    @property
    def catalogue(self) -> InterfaceCatalogue:
        """What describes the types of the system."""
        return self.interfaces.catalogue

    def bindings(self, node: NodeSpec) -> list[Binding]:
        """Return the behaviours of a node; they are listed once for all checks."""
        if node.path not in self._bindings:
            self._bindings[node.path] = [*node_bindings(node)]
        return self._bindings[node.path]

    def all_bindings(self) -> Iterator[Binding]:
        """Yield the behaviours of all nodes and processes."""
        for node in self.spec.nodes.values():
            yield from self.bindings(node)
        for process in self.spec.processes.values():
            yield from exit_bindings(process)

    @cached_property
    def _bindings(self) -> dict[DataPath, list[Binding]]:
        return {}

    def readings(self, node: NodeSpec) -> list[Reading]:
        """Return what each behaviour of a node does."""
        return [self.behaviours.read(node, each) for each in self.bindings(node)]

    def was_dropped(self, path: DataPath) -> bool:
        """Return whether an entry is missing because of an error that was reported already."""
        return path in self.system.dropped

    def has_real_type(self, entity: EndSpec | DeclaredEndSpec) -> bool:
        """Return whether the type of an entity is known to be the one that is meant.

        It is none that stands in for a missing one, hangs on a sample, or does not exist.
        """
        path, sampled = entity.path, self.system.sampled
        if self.was_dropped(path) or self.was_dropped((*path, 'type')):
            return False
        if sampled and self.system.positions.value(self.inner(path, 'type')) in sampled:
            return False
        return not self.catalogue.available or self.knows_type(entity)

    def knows_type(self, entity: EndSpec | DeclaredEndSpec) -> bool:
        """Return whether there is the type of an entity.

        An external process may have types of packages that are not installed here.
        """
        if self.catalogue.has(entity.type):
            return True
        package, known = entity.type.partition('/')[0], self.catalogue.packages()
        if package in known or not isinstance(entity, DeclaredEndSpec):
            return False
        return find_meant_package(package, known, most_edits=1) is None

    def at_value(
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        part: str = '',
        first: bool = False,
        **remarks: Unpack[Remarks],
    ) -> Diagnostic:
        """Return a finding at a value, or at the last (or `first`) `part` of its text."""
        span = self.system.positions.value(path).narrowed_to(part, first=first)
        return diagnostic_at(span, rule, message, **self._with_includes(path, span, remarks))

    def at_key(
        self, path: DataPath, rule: str, message: str, **remarks: Unpack[Remarks]
    ) -> Diagnostic:
        """Return a finding at a key."""
        span = self.system.positions.key(path)
        return diagnostic_at(span, rule, message, **self._with_includes(path, span, remarks))

    def _with_includes(self, path: DataPath, span: Span, remarks: Remarks) -> Remarks:
        """Return the remarks with where the file of a finding is included, if it is."""
        if span.source is self.system.positions.source:
            return remarks
        chain = self.system.chains.get(path[:2], ())
        return {**remarks, 'related': (*remarks.get('related', ()), *chain)}

    def related(self, path: DataPath, message: str) -> Related:
        """Return a second place of a finding: that of a key."""
        return Related(message, self.system.positions.key(path))

    def related_value(self, path: DataPath, message: str) -> Related:
        """Return a second place of a finding: that of a value."""
        return Related(message, self.system.positions.value(path))

    def inner(self, path: DataPath, key: str) -> DataPath:
        """Return the path of `key` in a mapping, or of the mapping where that is written short."""
        within = (*path, key)
        return within if within in self.system.positions.values else path
