"""YAML text → `SystemSpec`, in this order; each step is one function, and works on one record.

read → layers → arguments → expressions → schema → defaults → includes → specs

What is wrong with a file becomes findings of its record. Only what is wrong with the command line
is raised, since it is not in the file.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from composer import confidential
from composer.diagnostics import Diagnostic
from composer.language.arguments import sample_values, values_from_words
from composer.language.defaults import apply_defaults
from composer.language.evaluate import evaluate_expressions, give_arguments
from composer.language.includes.includer import Includer
from composer.language.includes.reaching import apply_changes, take_changes
from composer.language.layers import merge_documents
from composer.language.loaded_system import LoadedSystem, Reaching
from composer.language.nodl.named_documents import read_node_interfaces
from composer.language.parsing.container_parser import fold_containers
from composer.language.parsing.system_parser import parse_specs
from composer.language.paths import resolve_paths
from composer.language.set_option import apply_set_values
from composer.schema.structure import check_structure
from composer.yaml_text.reader import parse_document, read_document, refuse_launch_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from composer.language.arguments import GiveValues
    from composer.language.values.start_values import ReadValue
    from composer.yaml_text.document import Document


def load_system(  # noqa: PLR0913 - one for each part of a command line
    path: Path,
    words: Sequence[str] | None = None,
    *,
    layers: Sequence[Path] = (),
    set_values: Sequence[str] = (),
    text: bytes | Callable[[], Document] | None = None,
    before: LoadedSystem | None = None,
    read_value: ReadValue | None = None,
    ros_arguments: Sequence[str] = (),
) -> LoadedSystem:
    """Read a file as far as it can be read.

    Args:
        words: The arguments of the command line; `None` to read the file with its defaults, and
            with samples where there are none.
        layers: Files that change the first one, each over those before it.
        set_values: Changes of single values, as in `nodes.talker.log_level=debug`.
        text: The text of the file, if it is not to be read; or what reads it.
        before: A system whose records are kept where the data are the same.
        read_value: Reads the values that are known when the system starts; `None` for samples.
        ros_arguments: The arguments after `--ros-args` of the command line.

    Raises:
        UsageError: The words do not fit the arguments that the file declares, or a setting fits
            nothing.
        ComposerError: A value that is known when the system starts cannot be read.
    """
    confidential.begin([path, *layers])
    document = apply_set_values(_read([path, *layers], text), set_values)
    give_values = partial(values_from_words, words=words)
    return _load(document, path, give_values, before, read_value, ros_arguments)


def load_combinations(
    path: Path,
    *,
    layers: Sequence[Path] = (),
    matrix: Path | None = None,
    text: bytes | None = None,
) -> Iterator[tuple[str | None, LoadedSystem]]:
    """Yield the name of each combination that a file names, and the system read with it.

    Without combinations, that is the system as `load_system` reads it, without a name.

    Args:
        layers: Files that change the first one, each over those before it.
        matrix: A file whose combinations take the place of those under `check:`.
        text: The text of the file, if it is not to be read.
    """
    own = [path, *layers, *([matrix] if matrix else [])]
    confidential.begin(own)
    document = _read([path, *layers], text)
    if matrix is None and 'check' not in (document.data or {}):
        yield None, _load(document, path, sample_values)
        return
    # Most files name no combinations.
    from composer.language import combinations

    if matrix is not None:
        document = combinations.with_matrix(document, read_document(matrix))
    named = combinations.read_combinations(document)
    if not named:
        yield None, _load(document, path, sample_values)
    for each in named:
        confidential.begin(own)
        findings: list[Diagnostic] = []
        give_values = partial(
            combinations.values_from_combination, combination=each, findings=findings
        )
        system = _load(combinations.apply_combination(document, each), path, give_values)
        system.diagnostics += findings
        yield each.name, system


def load_system_text(
    text: str | bytes, path: Path = Path('<text>'), words: Sequence[str] | None = None
) -> LoadedSystem:
    """Read the text of a file that would be at `path`."""
    confidential.begin([path])
    content = text.encode() if isinstance(text, str) else text
    document = parse_document(content, str(path))
    return _load(document, path, partial(values_from_words, words=words))


def _read(paths: Sequence[Path], text: bytes | Callable[[], Document] | None) -> Document:
    path, *layers = paths
    if callable(text):
        main = text()
    else:
        main = read_document(path) if text is None else parse_document(text, str(path))
    return merge_documents([main, *map(read_document, layers)])


def _load(
    document: Document,
    path: Path,
    give_values: GiveValues,
    before: LoadedSystem | None = None,
    read_value: ReadValue | None = None,
    ros_arguments: Sequence[str] = (),
    reaching: Reaching | None = None,
) -> LoadedSystem:
    system = LoadedSystem.of(document, path)
    system.reaching = reaching or Reaching()
    system.ros_arguments = ros_arguments
    system.start.read = read_value
    if 'version' not in system.entries and not confidential.may_show_lines(str(path)):
        # What is wrong with it would tell what is in it.
        message = 'this is a link to a file outside of the project that is not a system'
        system.data = None
        system.diagnostics = [Diagnostic('unreadable-file', message, str(path))]
    if system.data is not None:
        _load_file(system, give_values)
        Includer(system, _load_file).include_all()
    if system.data is not None:
        parse_specs(system, before)
    if reaching is None and system.reaching.missed:
        # These are nodes of their own, or a finding.
        nodes = system.spec.nodes.values() if system.spec else ()
        again = Reaching(system.reaching.missed, [node.full_name for node in nodes])
        return _load(document, path, give_values, before, read_value, ros_arguments, again)
    return system


def _load_file(system: LoadedSystem, give_values: GiveValues) -> None:
    """Take a file, included or not, through the steps that concern it alone."""
    if 'version' not in system.entries and isinstance(system.entries.get('launch'), list):
        system.data = None
        system.diagnostics = [refuse_launch_file(system.positions.source.name)]
        return
    give_arguments(system, give_values)
    evaluate_expressions(system)
    if system.data is None:
        return
    take_changes(system)
    apply_changes(system)
    check_structure(system)
    fold_containers(system)
    resolve_paths(system)
    read_node_interfaces(system)
    apply_defaults(system)
