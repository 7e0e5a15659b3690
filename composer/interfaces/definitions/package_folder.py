"""Read the interface definitions of one package: a folder with `msg/`, `srv/` and `action/`.

Each error is a `Diagnostic` with its position; definitions without errors are described.
See https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Self

from composer.confidential import may_show_lines
from composer.diagnostics import Diagnostic, Related, SourceFile, Span, diagnostic_at
from composer.input_limits import (
    LINES_OF_DEFINITION,
    MAX_BYTES_OF_DEFINITIONS,
    MAX_DEFINITION_BYTES,
    MAX_LINES_OF_DEFINITIONS,
    UnreadableFileError,
    format_size,
    read_file,
)
from composer.interfaces.definitions.definition_parser import (
    DefinitionSyntaxError,
    load_parser,
    parse_message,
)
from composer.interfaces.definitions.statement_rules import check_statement, find_message
from composer.interfaces.definitions.statements import (
    SEPARATOR,
    Section,
    Statement,
    is_near_separator,
    split_sections,
)
from composer.interfaces.descriptions import (
    ActionDescription,
    InterfaceDescription,
    MessageDescription,
    ServiceDescription,
)
from composer.records import record
from composer.spelling import did_you_mean

PARTS: Final = {
    'msg': ('',),
    'srv': ('_Request', '_Response'),
    'action': ('_Goal', '_Result', '_Feedback'),
}
_WHAT_IS_SEPARATED: Final = {
    'srv': 'request and response',
    'action': 'goal, result and feedback',
}


@record
class TypeReference:
    """A field whose type is a message.

    Attributes:
        span: the place of the type.
        user: full name of the message that has the field.
        message: that message, such as `std_msgs/Header`.
    """

    span: Span
    user: str
    message: str


@record
class PackageDefinitions:
    """The definitions in a folder.

    Attributes:
        package: name of the interface package.
        folder: the folder of its definitions.
        sources: text of every definition file, by its path in the folder (`msg/Name.msg`).
        interfaces: the definitions without errors, by full name
            (`example_interfaces/srv/AddTwoInts`).
        references: uses of messages, for `check_definitions`.
        diagnostics: the errors.
        left_out: the full names of the interfaces that the file does not list and does not need.
    """

    package: str
    folder: Path
    sources: Mapping[str, str]
    interfaces: Mapping[str, InterfaceDescription]
    references: tuple[TypeReference, ...]
    diagnostics: tuple[Diagnostic, ...]
    left_out: frozenset[str] = frozenset()

    def names(self) -> dict[str, str]:
        """Return the full name of what each file in `sources` defines."""
        return {source: f'{self.package}/{source.rpartition(".")[0]}' for source in self.sources}

    def without(self, left_out: frozenset[str]) -> Self:
        """Return the definitions without some interfaces, and without the errors in these."""
        names = self.names()
        files = {str(self.folder / source) for source in names if names[source] in left_out}
        references = [
            reference for reference in self.references if reference.span.source.name not in files
        ]
        return replace(
            self,
            sources={name: self.sources[name] for name in names if names[name] not in left_out},
            interfaces={
                name: description
                for name, description in self.interfaces.items()
                if name not in left_out
            },
            references=tuple(references),
            diagnostics=tuple(error for error in self.diagnostics if error.file not in files),
            left_out=left_out & {*names.values()},
        )

    def messages(self) -> frozenset[str]:
        """Return the names of the messages, those with errors included, without the package."""
        return frozenset(Path(name).stem for name in self.sources if name.startswith('msg/'))


@dataclass(slots=True)
class ReadingBudget:
    """How much is left to be read, of all packages together."""

    bytes: int = MAX_BYTES_OF_DEFINITIONS
    lines: int = MAX_LINES_OF_DEFINITIONS

    @property
    def is_spent(self) -> bool:
        """Whether nothing more is read."""
        return min(self.bytes, self.lines) < 0

    def spend(self, text: str) -> None:
        """Count a definition."""
        self.bytes -= len(text)
        self.lines -= LINES_OF_DEFINITION + text.count('\n')


@dataclass(slots=True)
class _Reading:
    """What was read so far of a package."""

    package: str
    budget: ReadingBudget
    sources: dict[str, str] = field(default_factory=dict)
    interfaces: dict[str, InterfaceDescription] = field(default_factory=dict)
    references: list[TypeReference] = field(default_factory=list)
    diagnostics: list[Diagnostic] = field(default_factory=list)


def load_definitions(
    package: str, folder: Path, budget: ReadingBudget | None = None
) -> PackageDefinitions:
    """Read all definitions of a package.

    Args:
        package: its name.
        folder: the folder with `msg/`, `srv/` or `action/`; an installed package has them in
            `share/<package>`.
        budget: what is left, if it is one of several packages.

    Raises:
        ParserMissingError: `rosidl_adapter` is not installed.
    """
    reading = _Reading(package, budget or ReadingBudget())
    if not load_parser().is_valid_package_name(package):
        message = f'{package!r} is not the name of a package'
        advice = 'expected small letters, digits and single underscores, beginning with a letter'
        reading.diagnostics.append(_about_file(folder, 'bad-name', message, advice))
    paths = list(_list_files(reading, folder))
    if not paths:
        message = f'there are no definitions of {package} here'
        advice = 'expected files such as msg/Name.msg, srv/Name.srv or action/Name.action'
        reading.diagnostics.append(_about_file(folder, 'no-definitions', message, advice))
    for path in paths:
        if reading.budget.is_spent:
            break
        _read_file(reading, path)
    return PackageDefinitions(
        package,
        folder,
        reading.sources,
        reading.interfaces,
        tuple(reading.references),
        tuple(reading.diagnostics),
    )


def _list_files(reading: _Reading, folder: Path) -> Iterator[Path]:
    """Yield the definition files, and report those in the wrong folder."""
    for kind in PARTS:
        for path in sorted((folder / kind).glob('*')):
            suffix = path.suffix.removeprefix('.')
            if suffix == kind:
                yield path
            elif suffix in PARTS:
                message = f'a .{suffix} file is in the folder {kind}/'
                advice = f'move it to {suffix}/'
                reading.diagnostics.append(_about_file(path, 'misplaced-file', message, advice))


def _read_file(reading: _Reading, path: Path) -> None:
    kind, name = path.parent.name, path.stem
    before = len(reading.diagnostics)
    text = _read_text(reading, path)
    if text is None:
        reading.sources[f'{kind}/{path.name}'] = ''
        return
    source = SourceFile(str(path), tuple(text.splitlines()))
    reading.sources[f'{kind}/{path.name}'] = text
    _check_name(reading, path)
    sections = _cut(reading, source, kind)
    full_name = f'{reading.package}/{kind}/{name}'
    for section, part in zip(sections, PARTS[kind], strict=False):
        _check_section(reading, section, f'{full_name}{part}')
    has_no_errors = len(reading.diagnostics) == before
    if not has_no_errors and path.is_symlink() and not may_show_lines(str(path)):
        # What is wrong with it would tell what is in it.
        message = 'this is a link to a file outside of the project that is not a definition'
        reading.diagnostics[before:] = [_about_file(path, 'unreadable', message)]
    if has_no_errors and load_parser().is_valid_package_name(reading.package):
        _describe(reading, full_name, sections)


def _read_text(reading: _Reading, path: Path) -> str | None:
    try:
        data = read_file(path, MAX_DEFINITION_BYTES)
    except UnreadableFileError as error:
        reading.diagnostics.append(_about_file(path, 'unreadable', str(error)))
        return None
    text = data.decode(errors='replace')
    reading.budget.spend(text)
    if reading.budget.is_spent:
        message = (
            f'the definitions of all packages have more than {MAX_LINES_OF_DEFINITIONS:,} lines, '
            f'or {format_size(MAX_BYTES_OF_DEFINITIONS)}: this and the others are not read'
        )
        reading.diagnostics.append(_about_file(path, 'unreadable', message))
        return None
    try:
        data.decode()
    except UnicodeDecodeError as error:
        line = len(data[: error.start + 1].splitlines())
        place = Span(SourceFile(str(path), tuple(text.splitlines())), line, 1, 0)
        reading.diagnostics.append(diagnostic_at(place, 'not-utf-8', 'expected UTF-8 text'))
    return text


def _check_name(reading: _Reading, path: Path) -> None:
    name = path.stem
    if '_' in name or not load_parser().is_valid_message_name(name):
        better = ''.join(part[:1].upper() + part[1:] for part in name.split('_'))
        message = f'{name!r} is not the name of an interface: expected CamelCase'
        advice = did_you_mean(f'{better}{path.suffix}')
        reading.diagnostics.append(_about_file(path, 'bad-name', message, advice))


def _cut(reading: _Reading, source: SourceFile, kind: str) -> list[Section]:
    if kind == 'msg':
        return [Section(source, 1, len(source.lines) + 1)]
    wanted = len(PARTS[kind]) - 1
    expected = f'one line {SEPARATOR!r}' if wanted == 1 else f'{wanted} lines {SEPARATOR!r}'
    expected = f'{expected} between {_WHAT_IS_SEPARATED[kind]}'
    found = [
        Span(source, number, 1, len(line))
        for number, line in enumerate(source.lines, start=1)
        if is_near_separator(line)
    ]
    reading.diagnostics += [
        diagnostic_at(
            span,
            'bad-separator',
            f'expected exactly {SEPARATOR!r}',
            help='three dashes, with nothing before or after them',
        )
        for span in found[:wanted]
        if span.text != SEPARATOR
    ]
    reading.diagnostics += [
        diagnostic_at(span, 'bad-separator', f'expected no more than {expected}')
        for span in found[wanted:]
    ]
    if len(found) < wanted:
        end = Span(source, max(len(source.lines), 1), 1, 0)
        message = f'expected {expected}, found {len(found) or "none"}'
        reading.diagnostics.append(diagnostic_at(end, 'missing-separator', message))
    return split_sections(source)


def _check_section(reading: _Reading, section: Section, user: str) -> None:
    names: dict[str, Span] = {}
    for statement in section.statements():
        if is_near_separator(statement.type.text):
            reading.diagnostics.append(
                diagnostic_at(
                    statement.type,
                    'bad-separator',
                    'a message has no parts',
                    help='a service is defined in srv/, an action in action/',
                )
            )
            continue
        reading.diagnostics += check_statement(statement)
        reading.diagnostics += _check_duplicate(names, statement)
        message = find_message(reading.package, statement.type.text)
        if statement.kind != 'constant' and message is not None:
            reading.references.append(TypeReference(statement.type, user, message))


def _check_duplicate(names: dict[str, Span], statement: Statement) -> Iterator[Diagnostic]:
    span = statement.name
    first = names.setdefault(span.text, span)
    if span.text and first is not span:
        what = 'constant' if statement.kind == 'constant' else 'field'
        yield diagnostic_at(
            span,
            f'duplicate-{what}',
            f'the {what} {span.text!r} is already defined',
            help=f'the first one is on line {first.line}',
            related=[Related('the first one', first)],
        )


def _describe(reading: _Reading, full_name: str, sections: list[Section]) -> None:
    parts = []
    kind = full_name.split('/')[1]
    for section, part in zip(sections, PARTS[kind], strict=True):
        try:
            parts.append(parse_message(reading.package, f'{full_name}{part}', section.text))
        except DefinitionSyntaxError as error:
            place = Span(section.source, section.start, 1, 0)
            reading.diagnostics.append(diagnostic_at(place, 'bad-syntax', str(error)))
            return
    reading.interfaces[full_name] = _compose(full_name, parts)


def _compose(full_name: str, parts: list[MessageDescription]) -> InterfaceDescription:
    match parts:
        case [message]:
            return message
        case [request, response]:
            return ServiceDescription(full_name, request, response)
        case _:
            goal, result, feedback = parts
            return ActionDescription(full_name, goal, result, feedback)


def _about_file(path: Path, rule: str, message: str, advice: str | None = None) -> Diagnostic:
    return Diagnostic(rule, message, str(path), help=advice)
