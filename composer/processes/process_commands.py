"""`ProcessSpec` → the command line of a process, ROS arguments included."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import list_executables
from composer.errors import StartError
from composer.language.parameter_files import render_given_file
from composer.language.paths import PathError, resolve_path
from composer.programs import find_program_problem
from composer.ros_parameters.file_writer import render_parameters_for_all
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.language.specs import ParameterFileSpec, ProcessSpec


class CommandWriter:
    """Writes the command lines of processes.

    Args:
        folder: Where their parameter files are written.
        ros_arguments: The arguments after `--ros-args` of Composer's own command line.
        log_levels: `debug` for all loggers, `talker:=debug` for one; they override the file.
    """

    def __init__(
        self, folder: Path, ros_arguments: Sequence[str], log_levels: Sequence[str]
    ) -> None:
        self._folder = folder
        self._ros_arguments = _with_absolute_files(ros_arguments)
        self._log_levels = [_level_for_rcl(each) for each in log_levels]

    def write(self, spec: ProcessSpec, environment: Mapping[str, str]) -> list[str]:
        """Return the command line.

        Raises:
            StartError: The program or a parameter file does not exist.
        """
        command = [*_find_program(spec, environment), *self._ros_arguments_of(spec)]
        for text in (*command, *(f'{key}={value}' for key, value in spec.env.items())):
            if '\0' in text:
                message = f"process '{spec.name}': {text!r} contains a null character"
                raise StartError(message)
        return command

    def _ros_arguments_of(self, spec: ProcessSpec) -> list[str]:
        """Return the ROS arguments: of remapping rules the first wins, of all others the last."""
        if not spec.is_ros:
            return []
        arguments = ['--ros-args']
        if spec.parameters:
            path = self._write_file(render_parameters_for_all(spec.parameters))
            arguments += ['--params-file', str(path)]
        for file in spec.parameter_files:
            arguments += ['--params-file', str(self._give_file(spec, file))]
        if spec.log_level is not None:
            arguments += ['--log-level', spec.log_level]
        arguments += self._ros_arguments
        for level in self._log_levels:
            arguments += ['--log-level', level]
        if spec.node_name is not None:
            arguments += ['-r', f'__node:={spec.node_name}']
        if spec.namespace is not None:
            arguments += ['-r', f'__ns:={spec.namespace}']
        for old, new in spec.remap:
            arguments += ['-r', f'{old}:={new}']
        return arguments

    def _give_file(self, spec: ProcessSpec, file: ParameterFileSpec) -> Path:
        """Return a parameter file as the process is to read it."""
        path = _find_file(spec, file.file)
        return self._write_file(render_given_file(file)) if file.is_changed else path

    def _write_file(self, text: str) -> Path:
        path = self._folder / f'{len(list(self._folder.iterdir()))}.yaml'
        path.write_text(text, encoding='utf-8')
        return path


def find_folder(spec: ProcessSpec) -> str | None:
    """Return the working directory of a process; `None` for that of Composer.

    Raises:
        StartError: It does not exist.
    """
    if spec.cwd is None:
        return None
    folder = _resolve(spec, spec.cwd)
    if not os.path.isdir(folder):
        message = f"process '{spec.name}': there is no folder '{folder}' to run in"
        raise StartError(message)
    return str(folder)


def _with_absolute_files(ros_arguments: Sequence[str]) -> list[str]:
    """Return the arguments with paths that hold in any working directory."""
    before = ['', *ros_arguments[:-1]]
    return [
        str(Path(each).absolute()) if option == '--params-file' else each
        for option, each in zip(before, ros_arguments, strict=False)
    ]


def _level_for_rcl(request: str) -> str:
    """Return `robot.talker:=debug` for `/robot/talker:=debug`."""
    name, separator, level = request.rpartition(':=')
    return f'{name.strip("/").replace("/", ".")}{separator}{level}'


def _find_program(spec: ProcessSpec, environment: Mapping[str, str]) -> list[str]:
    """Return the program and its own arguments.

    Raises:
        StartError: The program does not exist.
    """
    if spec.package is not None:
        executables = list_executables(spec.package)
        for path in executables:
            if path.name == spec.executable:
                return [str(path.absolute()), *spec.arguments]
        names = [path.name for path in executables]
        message = f"process '{spec.name}': '{spec.package}' has no executable '{spec.executable}'"
        raise StartError(message, help=suggest(spec.executable, names, 'it has'))
    folder = Path(find_folder(spec) or '.')
    command = spec.command
    if spec.launch is not None:
        path = _find_file(spec, spec.launch, 'launch file')
        # Without a terminal, whose Ctrl-C would go to all, it tells its processes to end.
        command = ('ros2', 'launch', '--noninteractive', str(path), *spec.arguments)
    problem = find_program_problem(command[0], folder, environment)
    if problem:
        message, advice = problem
        message = f"process '{spec.name}': {message}"
        raise StartError(message, help=advice)
    return list(command)


def _find_file(spec: ProcessSpec, text: str, noun: str = 'parameter file') -> Path:
    path = _resolve(spec, text)
    if not os.path.isfile(path):
        message = f"process '{spec.name}': there is no {noun} '{path}'"
        raise StartError(message)
    # The process may have another working directory.
    return path.absolute()


def _resolve(spec: ProcessSpec, text: str) -> Path:
    try:
        return resolve_path(text, Path())
    except PathError as error:
        message = f"process '{spec.name}': {error}"
        raise StartError(message, help=error.help) from error
