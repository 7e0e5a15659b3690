"""The message classes of recorded topics: installed ones, or built of what the file defines."""

from __future__ import annotations

import re
import tempfile
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.errors import ComposerError
from composer.input_limits import MAX_BYTES_OF_DEFINITIONS, MAX_RECORDED_TYPES, format_size
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.classes import InterfaceNotFoundError, import_interface
from composer.recordings.definitions import full_definition, import_message, type_hash
from composer.recordings.recorded_topics import RecordedTopic, RecordingError, full_type_name

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

_PART: Final = re.compile(r'^=+\nMSG: *(\S+) *\n', re.MULTILINE)
_FIELD: Final = re.compile(r'^[ \t]*+([\w/]++)(\S*+)[ \t]++(\w++)\b(?![ \t]*+=)', re.MULTILINE)
# By its other name, as `full_definition` has it.
_OTHER_NAMES: Final = {'char': 'uint8'}


class MessageTypes:
    """The classes of recorded topics.

    Packages that are not installed are built of the definitions in the file, as far as these and
    the build tools are there.

    Args:
        progress: Gets a short line about each step that takes long.

    Attributes:
        problems: Why the messages of a topic cannot be used, by its name and type.
    """

    def __init__(
        self,
        topics: Collection[RecordedTopic],
        progress: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.problems: dict[tuple[str, str], str] = {}
        self._classes: dict[tuple[str, str], type] = {}
        usable = []
        for topic in topics:
            if problem := topic.problem or _find_problem(topic):
                self.problems[topic.name, topic.type] = problem
            else:
                usable.append(topic)
        reason = _build_missing(usable, progress)
        for topic in usable:
            try:
                found = import_message(topic.type)
                _check_definition(topic, found)
            except ComposerError as error:
                is_absent = reason and isinstance(error, InterfaceNotFoundError)
                self.problems[topic.name, topic.type] = str(reason if is_absent else error)
            else:
                self._classes[topic.name, topic.type] = found

    def find(self, topic: RecordedTopic) -> type | None:
        """Return the class of a topic's messages; `None` if it has a problem."""
        return self._classes.get((topic.name, topic.type))

    def decoder(self, topic: RecordedTopic) -> Callable[[bytes], Any] | None:
        """Return what makes a message of its recorded bytes; `None` if it has a problem."""
        found = self.find(topic)
        return found and partial(_decode, topic, found)


def _find_problem(topic: RecordedTopic) -> str:
    """Return why the definition of a topic's type cannot be used; nothing if it can."""
    try:
        split_definition(topic.definition, topic.type)
    except RecordingError as error:
        return str(error)
    return ''


def _decode(topic: RecordedTopic, message_class: type, data: bytes) -> Any:
    try:
        return _rclpy.rclpy_deserialize(data, message_class)
    except Exception as error:
        message = f"a recorded message of '{topic.name}' is no {topic.type}: {error}"
        raise RecordingError(message) from error


def _check_definition(topic: RecordedTopic, message_class: type) -> None:
    """Refuse a topic whose type was another one when it was recorded.

    Raises:
        RecordingError: Its messages would be read wrongly.
    """
    own_hash = type_hash(message_class)
    if topic.type_hash and own_hash:
        is_same = topic.type_hash == own_hash
    elif topic.definition:
        ours, theirs = full_definition(message_class), topic.definition
        is_same = _fields_by_type(ours, topic.type) == _fields_by_type(theirs, topic.type)
    else:
        is_same = True
    if not is_same:
        message = f'{topic.type} was recorded with another definition than the installed one'
        raise RecordingError(message)


@lru_cache(maxsize=64)
def _fields_by_type(definition: str, root: str) -> dict[str, list[tuple[str, ...]]]:
    """Return the types and names of fields, with short names of types, whatever else differs."""
    return {
        name: [
            (_OTHER_NAMES.get(kind, kind.rpartition('/')[2]), bounds, field)
            for kind, bounds, field in _FIELD.findall(text)
        ]
        for name, text in split_definition(definition, root).items()
    }


@lru_cache(maxsize=64)
def split_definition(definition: str, root: str) -> dict[str, str]:
    """Return the definition of each message in a recorded one, by full name.

    Args:
        root: The full name of the first one.

    Raises:
        RecordingError: It is too large, or names what is no type.
    """
    if len(definition) > MAX_BYTES_OF_DEFINITIONS:
        message = f'the definition of {root} has more than {format_size(MAX_BYTES_OF_DEFINITIONS)}'
        raise RecordingError(message)
    first, *others = _PART.split(definition)
    found = {root: first}
    for name, text in zip(others[::2], others[1::2], strict=True):
        full_name = full_type_name(name)
        if not full_name:
            message = f"the definition of {root} has a part '{name}', which is no type of ROS"
            raise RecordingError(message)
        found[full_name] = text
    return found


def _build_missing(
    topics: Iterable[RecordedTopic], progress: Callable[[str], None]
) -> ComposerError | None:
    """Build the packages that are not installed; return why that did not work."""
    missing: dict[str, dict[str, str]] = {}
    prefixes = ament_prefixes()
    for topic in topics:
        for name, text in split_definition(topic.definition, topic.type).items():
            package, kind, short = name.split('/')
            is_absent = not find_package(package, prefixes, INTERFACE_INDEX)
            if kind == 'msg' and is_absent and topic.definition:
                missing.setdefault(package, {})[short] = text
    if not missing or _can_import(missing):
        return None
    count = sum(map(len, missing.values()))
    if count > MAX_RECORDED_TYPES:
        message = (
            f'{count:,} recorded types are not installed, and {MAX_RECORDED_TYPES} are built at '
            'most: install their packages, or name fewer topics'
        )
        return RecordingError(message)
    # They are imported only where something must be built.
    from composer.interfaces.build.provision import import_packages, provide_packages
    from composer.interfaces.definitions.packages import load_packages

    try:
        with tempfile.TemporaryDirectory(prefix='composer-recording-') as folder:
            folders = _write_definitions(Path(folder), missing)
            packages = load_packages(folders, InterfaceCatalogue())
            import_packages(provide_packages(packages, progress))
    except ComposerError as error:
        return error
    return None


def _can_import(missing: Mapping[str, Iterable[str]]) -> bool:
    """Return whether Python finds the messages nevertheless, as in a folder of `PYTHONPATH`."""
    try:
        for package, names in missing.items():
            for name in names:
                import_interface(f'{package}/msg/{name}')
    except InterfaceNotFoundError:
        return False
    return True


def _write_definitions(folder: Path, missing: Mapping[str, Mapping[str, str]]) -> dict[str, Path]:
    folders = {}
    for package, messages in missing.items():
        folders[package] = folder / package
        (folder / package / 'msg').mkdir(parents=True)
        for name, text in messages.items():
            path = folder / package / 'msg' / f'{name}.msg'
            path.write_text(text, encoding='utf-8')
    return folders
