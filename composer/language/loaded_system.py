"""The record that a file is read into, step by step."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.language.arguments import ArgumentValues
from composer.language.values.start_values import StartValues
from composer.yaml_text.document import Document

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from composer.diagnostics import Related, SourceFile, Span
    from composer.language.arguments import ArgumentSpec
    from composer.language.specs import SystemSpec
    from composer.yaml_text.positions import Branch, DataPath, Key

# The sections whose entries become part of a file that includes theirs.
PARTS = ('nodes', 'processes', 'qos', 'interfaces', 'workers', 'hosts')


@dataclass(slots=True)
class Reaching:
    """What layers say of nodes by their full names; all files of a system share it.

    Attributes:
        own: The names of those that no file has: nodes of their own.
        full_names: Those of all nodes, once they are known.
        changes: What is said of the others.
        met: The names that a file has.
    """

    own: Collection[str] = ()
    full_names: Collection[str] = ()
    changes: dict[str, tuple[dict[str, Any], Branch]] = field(default_factory=dict)
    met: set[str] = field(default_factory=set)

    @property
    def missed(self) -> set[str]:
        """The names that no file has."""
        return self.changes.keys() - self.met


@dataclass(slots=True, kw_only=True)
class LoadedSystem(Document):
    """A file, and what each step of the pipeline has made of it so far.

    An included file has a record of its own until it is merged into the file that includes it.

    Attributes:
        path: The file; relative module paths and the like are searched from its folder.
        arguments: The arguments that the file declares.
        given: Their values.
        included: The files that are part of it.
        named: The files that it includes, also if they cannot be read.
        chains: The includes that entries come from, innermost first, by the entries' paths.
        inner_names: The namespaces, as written, and simple names of nodes that are called by
            their full names only because another node has the simple one.
        inherited: The paths of hosts that entries have from defaults and includes: that of their
            worker goes first.
        sampled_unused: As `sampled`, of what is left out.
        start: The values that are read when the system starts.
        filled: The data with these values, or samples of them, in place.
        namespace: That of the includes around it.
        ros_arguments: The arguments after `--ros-args` of the command line.
        reaching: What layers say of nodes by their full names.
        spec: The system without the parts that were wrong; `None` if nothing could be read.
        unused: As `spec`, of the nodes and processes whose `when`, or that of their include, does
            not hold; and of nodes with entities whose `when` does not hold, with all of these.
    """

    path: Path
    arguments: Mapping[str, ArgumentSpec] = field(default_factory=dict)
    given: ArgumentValues = field(default_factory=lambda: ArgumentValues({}))
    included: dict[SourceFile, None] = field(default_factory=dict)
    named: dict[Path, None] = field(default_factory=dict)
    chains: dict[DataPath, tuple[Related, ...]] = field(default_factory=dict)
    inner_names: dict[str, tuple[str, str]] = field(default_factory=dict)
    inherited: set[DataPath] = field(default_factory=set)
    sampled_unused: list[Span] = field(default_factory=list)
    start: StartValues = field(default_factory=StartValues)
    filled: dict[str, Any] = field(default_factory=dict)
    namespace: str = ''
    ros_arguments: Sequence[str] = ()
    reaching: Reaching = field(default_factory=Reaching)
    spec: SystemSpec | None = None
    unused: SystemSpec | None = None
    _branches: dict[str, dict[Key, Branch]] = field(default_factory=dict)
    _notes: dict[DataPath, list[tuple[DataPath, str]]] | None = None

    @classmethod
    def of(cls, document: Document, path: Path) -> LoadedSystem:
        """Return the record of a file that was read; the document stays as it is."""
        positions = document.positions.copy()
        return cls(document.data, positions, [*document.diagnostics], path=path)

    @property
    def entries(self) -> dict[str, Any]:
        """The data; empty if nothing could be read."""
        return {} if self.data is None else self.data

    @property
    def files(self) -> list[Path]:
        """The file and those that are included in it."""
        return [self.path, *(Path(source.name) for source in self.included)]

    def notes_by_entry(self) -> dict[DataPath, list[tuple[DataPath, str]]]:
        """Return the notes of each entry of a section, by their paths from there."""
        if self._notes is None:
            self._notes = {}
            for path, note in self.notes.items():
                self._notes.setdefault(path[:2], []).append((path[2:], note))
        return self._notes

    def leave_out_all(self) -> None:
        """Leave out all that the file declares."""
        self.left_out = {
            (section, name) for section in PARTS for name in self.entries.get(section, ())
        }
        self.sampled_unused += self.sampled
        self.sampled = []

    def branches(self, section: str) -> dict[Key, Branch]:
        """Return the positions of the entries of a section; call it when they are final."""
        if section not in self._branches:
            self._branches[section] = self.positions.branches((section,))
        return self._branches[section]
