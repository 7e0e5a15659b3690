"""Run a launch file or a system with stand-ins for its programs, in a process of its own.

`python -m composer.cli.importing.stand_in_runs launch|system FOLDER ENDS FILE [NAME:=VALUE]…`,
with the names of the programs that end at once, separated by commas.
"""

from __future__ import annotations

import importlib
import shlex
import sys
from pathlib import Path
from typing import Any

from composer.cli.main import run
from composer.launch_files.launched_programs import SLEEP
from composer.launch_files.verification import stand_in
from composer.processes.process_commands import CommandWriter


class StandIns:
    """The command lines of stand-ins.

    Args:
        folder: Where they write down what they are given.
        ends: The names of the programs that end at once.
    """

    def __init__(self, folder: str, ends: str) -> None:
        self._folder = folder
        self._ends = ends.split(',')

    def command(self, command: list[str]) -> list[str]:
        """Return the command line of the stand-in for a program."""
        ends = Path(command[0]).name in self._ends
        script = [sys.executable, '-I', '-S', str(stand_in.__file__)]
        return [*script, self._folder, str(int(ends)), *command]


def run_launch(path: str, arguments: list[str], stand_ins: StandIns) -> int:
    """Run a launch file, as `ros2 launch` does."""
    launch = importlib.import_module('launch')
    actions = importlib.import_module('launch.actions')
    sources = importlib.import_module('launch.launch_description_sources')
    local = importlib.import_module('launch.actions.execute_local')
    execute = local.async_execute_process

    def execute_stand_in(*args: Any, cmd: Any, shell: bool = False, **keywords: Any) -> Any:
        line = cmd if isinstance(cmd, str) else ' '.join(cmd)
        words = ['/bin/sh', '-c', line] if shell else list(cmd)
        keywords['emulate_tty'] = False
        # A prefix that only waits is a delay of the system.
        words = words[3:] if SLEEP.fullmatch(shlex.join(words[:3])) else words
        return execute(*args, cmd=stand_ins.command(words), shell=False, **keywords)

    vars(local)['async_execute_process'] = execute_stand_in
    service = launch.LaunchService(argv=arguments, noninteractive=True)
    given = [tuple(each.split(':=', 1)) for each in arguments]
    source = sources.AnyLaunchDescriptionSource(path)
    include = actions.IncludeLaunchDescription(source, launch_arguments=given)
    service.include_launch_description(launch.LaunchDescription([include]))
    return int(service.run())


def run_system(path: str, arguments: list[str], stand_ins: StandIns) -> int:
    """Run a system, as `composer up` does."""
    write = CommandWriter.write

    def write_stand_in(self: CommandWriter, *args: Any, **keywords: Any) -> list[str]:
        return stand_ins.command(write(self, *args, **keywords))

    setattr(CommandWriter, 'write', write_stand_in)  # noqa: B010 - for this process alone
    return run(['up', path, *arguments, '--no-control'])


if __name__ == '__main__':
    kind, folder, ends, path, *arguments = sys.argv[1:]
    runner = run_launch if kind == 'launch' else run_system
    sys.exit(runner(path, arguments, StandIns(folder, ends)))
