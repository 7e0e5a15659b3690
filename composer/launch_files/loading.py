"""The installed `launch` and `launch_ros`: reading launch files, and the lines of their actions.

Only this file, and what runs launch files for `composer import --verify`, imports them.
"""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.parsers import expat

from composer.errors import ComposerError
from composer.launch_files.results import LaunchError, Origin

if TYPE_CHECKING:
    from collections.abc import Iterator

_MODULES = ('launch', 'launch_ros', 'launch_xml', 'launch_yaml')
_HELP = (
    "source ROS 2, as in 'source /opt/ros/jazzy/setup.bash', and start Composer with its Python; "
    'it comes with ros-$ROS_DISTRO-ros2launch'
)


class Loader:
    """Reads launch files with the installed `launch`.

    Raises:
        ComposerError: It is not installed.
    """

    def __init__(self) -> None:
        for name in _MODULES:
            try:
                importlib.import_module(name)
            except ImportError as error:
                message = f"'{name}' cannot be imported: {error}"
                raise ComposerError(message, help=_HELP) from error
        launch: Any = sys.modules['launch']
        self._launch = launch
        self.context: Any = launch.LaunchContext()
        self._read = _Configurations()
        # It has no other way to be told what is read.
        setattr(self.context, '_LaunchContext__launch_configurations', self._read)  # noqa: B010
        self._folders = tuple(
            f'{Path(str(sys.modules[name].__file__)).parent}/' for name in _MODULES
        )
        self._origins = _Origins(self._folders)

    def open(self, path: Path) -> Any:
        """Return the action that includes a launch file, as `ros2 launch` does with its own."""
        sources = importlib.import_module('launch.launch_description_sources')
        source = sources.AnyLaunchDescriptionSource(str(path))
        return self._launch.actions.IncludeLaunchDescription(source)

    def load(self, source: Any, including: Path | None) -> Any:
        """Return the description of a launch file.

        Args:
            including: The launch file around it.

        Raises:
            LaunchError: It cannot be read.
        """
        if including is not None:
            self.context.extend_locals(
                {
                    'current_launch_file_path': str(including),
                    'current_launch_file_directory': str(including.parent),
                }
            )
        with self._origins.recorded():
            try:
                return source.get_launch_description(self.context)
            except ComposerError:
                raise
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                cause = error.__cause__ or error
                message = f'{source.location}: {type(cause).__name__}: {cause}'
                raise LaunchError(message, help=_help_for(cause)) from error

    def parse(self, text: str) -> Any:
        """Return the substitutions in a text, as in `$(var side)`."""
        module = importlib.import_module('launch.frontend.parse_substitution')
        return module.parse_substitution(text)

    def origin_of(self, entity: Any) -> Origin:
        """Return where an action was made."""
        return getattr(entity, '_composer_origin', Origin())

    @contextmanager
    def reading(self) -> Iterator[list[str]]:
        """Record the names of configurations that are read in the block."""
        before, self._read.names = self._read.names, []
        with self._origins.recorded():
            try:
                yield self._read.names
            finally:
                self._read.names = before


def _help_for(error: BaseException) -> str | None:
    if type(error).__name__ == 'PackageNotFoundError':
        return 'source the workspace that has the package, or install it'
    if isinstance(error, KeyError):
        return 'if it is an environment variable, set it as for ros2 launch'
    return None


class _Configurations(dict[str, Any]):
    """Launch configurations that note which of them are read."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []

    def _note(self, name: Any) -> None:
        if name not in self.names:
            self.names.append(name)

    def __getitem__(self, name: str) -> Any:
        self._note(name)
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        self._note(name)
        return super().__contains__(name)

    def get(self, name: str, default: Any = None) -> Any:
        self._note(name)
        return super().get(name, default)

    def items(self) -> Any:
        self._note_all()
        return super().items()

    def values(self) -> Any:
        self._note_all()
        return super().values()

    def copy(self) -> Any:
        self._note_all()
        return super().copy()

    def _note_all(self) -> None:
        for name in self:
            self._note(name)


class _Origins:
    """Writes into each action where it was made: a line of Python, or an element of XML."""

    def __init__(self, folders: tuple[str, ...]) -> None:
        self._folders = (*folders, f'{Path(__file__).parent}/')
        self._elements: list[Origin] = []
        self._lines: dict[int, Origin] = {}
        self._roots: list[Any] = []

    @contextmanager
    def recorded(self) -> Iterator[None]:
        """Record the origins of the actions that are made in the block."""
        action = importlib.import_module('launch.action').Action
        frontend = importlib.import_module('launch.frontend.parser').Parser
        xml = importlib.import_module('launch_xml.parser').Parser
        before = action.__init__, frontend.parse_action, xml.__dict__['load']
        action.__init__ = self._noting(before[0])
        frontend.parse_action = self._following(before[1])
        xml.load = classmethod(self._numbering(before[2].__func__))
        try:
            yield
        finally:
            action.__init__, frontend.parse_action = before[0], before[1]
            xml.load = before[2]

    def _noting(self, original: Any) -> Any:
        def init(entity: Any, *args: Any, **keywords: Any) -> None:
            vars(entity)['_composer_origin'] = self._element() or self._line()
            original(entity, *args, **keywords)

        return init

    def _following(self, original: Any) -> Any:
        def parse(parser: Any, entity: Any) -> Any:
            element = getattr(entity, '_Entity__xml_element', None)
            self._elements.append(self._lines.get(id(element), Origin()))
            try:
                return original(parser, entity)
            finally:
                self._elements.pop()

        return parse

    def _numbering(self, original: Any) -> Any:
        def load(cls: Any, file: Any) -> Any:
            entity, parser = original(cls, file)
            root = getattr(entity, '_Entity__xml_element', None)
            name = file if isinstance(file, str) else getattr(file, 'name', '')
            if root is not None and os.path.isfile(str(name)):
                self._roots.append(root)  # an `id` is that of one object while it lives
                numbers = _element_lines(Path(str(name)))
                for element, line in zip(root.iter(), numbers, strict=False):
                    self._lines[id(element)] = Origin(Path(str(name)), line)
            return entity, parser

        return load

    def _element(self) -> Origin:
        return self._elements[-1] if self._elements else Origin()

    def _line(self) -> Origin:
        frame: Any = sys._getframe(2)  # noqa: SLF001 - as the module `inspect` does
        while frame is not None:
            name = frame.f_code.co_filename
            if not name.startswith((*self._folders, '<')):
                is_launch_file = '/composer/' not in name and not name.startswith(sys.base_prefix)
                return Origin(Path(name), frame.f_lineno) if is_launch_file else Origin()
            frame = frame.f_back
        return Origin()


def _element_lines(path: Path) -> list[int]:
    """Return the lines in which the elements of an XML file begin, in their order."""
    lines: list[int] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda *_: lines.append(parser.CurrentLineNumber)
    parser.Parse(path.read_bytes(), True)
    return lines
