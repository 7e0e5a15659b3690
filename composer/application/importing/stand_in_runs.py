"""Run a launch file or a system with stand-ins for its programs, in a process of its own.

The arguments of the module are `launch` or `system`, the folder that stand-ins write to, the names
of the programs that end at once, separated by commas, the file, and its arguments.
"""

from __future__ import annotations

import importlib
import itertools
import json
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from composer.application.up import up
from composer.launch_files.launched_programs import SLEEP
from composer.launch_files.verification import stand_in
from composer.processes.process_commands import CommandWriter

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.processes.external_process import ExternalProcess
    from composer.runtime.external.components import Components


class StandIns:
    """The command lines of stand-ins.

    Args:
        folder: Where they write down what they are given.
        ends: The names of the programs that end at once.
    """

    def __init__(self, folder: str, ends: str) -> None:
        self._folder = folder
        self._ends = ends.split(',')
        # Actions of launch load from several threads.
        self._requests = itertools.count(1)

    def command(self, command: list[str]) -> list[str]:
        """Return the command line of the stand-in for a program."""
        ends = Path(command[0]).name in self._ends
        script = [sys.executable, '-I', '-S', str(stand_in.__file__)]
        return [*script, self._folder, str(int(ends)), *command]

    def load(self, container: str, request: Any) -> None:
        """Write down what a container is asked to load, a `LoadNode.Request`."""
        from rclpy.parameter import Parameter

        values = [Parameter.from_parameter_msg(each) for each in request.parameters]
        extra = [Parameter.from_parameter_msg(each) for each in request.extra_arguments]
        written = {
            'container': container,
            'plugin': request.plugin_name,
            'name': request.node_name,
            'namespace': request.node_namespace,
            'remaps': list(request.remap_rules),
            'parameters': {each.name: each.value for each in values},
            'extra': {each.name: each.value for each in extra},
        }
        number = next(self._requests)
        hidden = Path(self._folder) / f'.request_{number}'
        hidden.write_text(json.dumps(written, default=list), encoding='utf-8')
        hidden.rename(Path(self._folder) / f'request_{number}.json')


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
    _write_loads(stand_ins)
    service = launch.LaunchService(argv=arguments, noninteractive=True)
    given = [tuple(each.split(':=', 1)) for each in arguments]
    source = sources.AnyLaunchDescriptionSource(path)
    include = actions.IncludeLaunchDescription(source, launch_arguments=given)
    service.include_launch_description(launch.LaunchDescription([include]))
    return int(service.run())


def _write_loads(stand_ins: StandIns) -> None:
    """Have launch write down what it would load into containers: stand-ins answer nothing."""
    try:
        loading = importlib.import_module('launch_ros.actions.load_composable_nodes')
    except ImportError:
        return
    action = loading.LoadComposableNodes

    def write(self: Any, request: Any, _context: Any) -> None:
        stand_ins.load(vars(self)[f'_{action.__name__}__final_target_container_name'], request)

    setattr(action, '_load_node', write)  # noqa: B010 - for this process alone
    client = SimpleNamespace(create_client=lambda *_: None)
    vars(loading)['get_ros_node'] = lambda _context: client


def run_system(path: str, arguments: list[str], stand_ins: StandIns) -> int:
    """Run a system, as `composer up` does."""
    # rclpy takes its time to import, and a launch file without components does without it.
    from composer.runtime.external import components

    write = CommandWriter.write

    def write_stand_in(self: CommandWriter, *args: Any, **keywords: Any) -> list[str]:
        return stand_ins.command(write(self, *args, **keywords))

    def write_loads(self: Components, processes: Iterable[ExternalProcess]) -> Iterator[Any]:
        for process in processes:
            for each in process.spec.components.values():
                stand_ins.load(process.spec.full_name, self.request_for(each))
        return iter(())

    setattr(components.Components, 'waiters', write_loads)  # noqa: B010 - here alone, too
    setattr(CommandWriter, 'write', write_stand_in)  # noqa: B010 - for this process alone
    return up([Path(path)], arguments, is_asked=False, ends_process=True)


if __name__ == '__main__':
    kind, folder, ends, path, *arguments = sys.argv[1:]
    runner = run_launch if kind == 'launch' else run_system
    sys.exit(runner(path, arguments, StandIns(folder, ends)))
