"""YAML text → `SystemSpec`: read → layers → arguments → templates → schema → includes → specs.

Each step is one module; findings are collected on the way. Only the words of the command line
raise, since what is wrong with them is not in the file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.language.arguments import ArgumentSpec, parse_arguments
from composer.language.includes.includer import Includer
from composer.language.instances import PARTS, ArgumentValues, read_instance, sample_values
from composer.language.layers import merge_documents
from composer.language.parsing.system_parser import parse_system
from composer.language.set_option import apply_set_values
from composer.yaml_text.reader import Document, parse_document, read_document

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from composer.diagnostics import Diagnostic, Related, SourceFile, Span
    from composer.language.specs import SystemSpec
    from composer.yaml_text.positions import DataPath, SourceMap


@dataclass(frozen=True, slots=True)
class LoadedSystem:
    """What could be read of a file, and what was wrong with the rest.

    Attributes:
        path: The file; relative module paths and the like are sought from its folder.
        spec: The system without the parts that were wrong; `None` if nothing could be read.
        dropped: The paths of the data that were left out of `spec` for that.
        arguments: What the file takes from the command line.
        sampled: Where values stand that hang on samples of arguments: what is said of these
            need not hold for the real ones.
        data: The whole system as plain data, all included, with nothing left to evaluate.
        values: What the arguments are.
        included: The files that are part of it.
        chains: Where entries come from by includes, innermost first, by their paths.
        notes: Where the values that the expressions of a scalar use come from, by its path.
        unused: As `spec`, of the nodes and processes whose `when`, or that of their include, does
            not hold.
        sampled_unused: As `sampled`, of what is said of `unused` alone.
    """

    path: Path
    spec: SystemSpec | None
    positions: SourceMap
    dropped: frozenset[DataPath]
    diagnostics: tuple[Diagnostic, ...]
    arguments: Mapping[str, ArgumentSpec] = field(default_factory=dict)
    sampled: tuple[Span, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    included: tuple[SourceFile, ...] = ()
    chains: Mapping[DataPath, tuple[Related, ...]] = field(default_factory=dict)
    notes: Mapping[DataPath, str] = field(default_factory=dict)
    unused: SystemSpec | None = None
    sampled_unused: tuple[Span, ...] = ()

    @property
    def files(self) -> list[Path]:
        """The file and those that are included in it."""
        return [self.path, *(Path(source.name) for source in self.included)]


def load_system(
    path: Path,
    words: Sequence[str] | None = None,
    *,
    layers: Sequence[Path] = (),
    set_values: Sequence[str] = (),
) -> LoadedSystem:
    """Read a file as far as it can be read.

    Args:
        words: The arguments of the command line; `None` to read the file with its defaults, and
            with samples where there are none.
        layers: Files that change the first one, each over those before it.
        set_values: Changes of single values, as in `nodes.talker.log_level=debug`.

    Raises:
        UsageError: The words do not fit the arguments that the file declares, or a setting fits
            nothing.
    """
    documents = [read_document(each) for each in (path, *layers)]
    return _load(apply_set_values(merge_documents(documents), set_values), path, words)


def load_system_text(
    text: str, path: Path = Path('<text>'), words: Sequence[str] | None = None
) -> LoadedSystem:
    """Read the text of a file that would stand at `path`."""
    return load_system_content(text.encode(), path, words)


def load_system_content(
    content: bytes, path: Path, words: Sequence[str] | None = None
) -> LoadedSystem:
    """Read the bytes of a file that would stand at `path`."""
    return _load(parse_document(content, str(path)), path, words)


def _load(document: Document, path: Path, words: Sequence[str] | None) -> LoadedSystem:
    def give_values(
        declared: Mapping[str, ArgumentSpec],
    ) -> ArgumentValues:
        if words is None:
            return sample_values(declared)
        values, given = parse_arguments(declared, words)
        return ArgumentValues(values, origins=dict.fromkeys(given, 'command line'))

    instance = read_instance(document, give_values)
    if instance is None:
        return LoadedSystem(path, None, document.positions, frozenset(), document.diagnostics)
    whole = Includer(instance.data.get('environment', {})).include(instance, path)
    used, unused = _divided(whole.data, whole.left_out)
    return LoadedSystem(
        path,
        parse_system(used, path.stem),
        whole.positions,
        frozenset(whole.dropped),
        tuple(whole.diagnostics),
        whole.arguments,
        tuple(whole.sampled_spans),
        used,
        whole.values,
        tuple(whole.included),
        whole.chains,
        whole.notes,
        parse_system(unused, path.stem) if unused else None,
        tuple(whole.spans_left_out),
    )


def _divided(
    data: dict[str, Any], left_out: Collection[DataPath]
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Return the data without the entries that are left out, and with these alone.

    QoS profiles and interfaces are for both.
    """
    if not left_out:
        return data, None
    used, unused = dict(data), dict(data)
    for section in PARTS:
        entries = data.get(section, {})
        used[section] = {k: v for k, v in entries.items() if (section, k) not in left_out}
    for section in ('nodes', 'processes'):
        entries = data.get(section, {})
        unused[section] = {k: v for k, v in entries.items() if (section, k) in left_out}
    return used, unused
