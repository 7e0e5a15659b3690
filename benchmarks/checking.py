"""What it costs to check and compare files, each time in a new process, as people and CI do."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_REPEATS = 5

_NODE = """\
  node_{number}:
    parameters: {{name: {{default: robot_{number}, description: who it is}}}}
    publishers:
      text_{number}: std_msgs/msg/String
      pace_{number}: {{type: geometry_msgs/msg/Twist, topic: /pace, qos: 5, external: true}}
    subscriptions:
      heard:
        type: std_msgs/msg/String
        topic: text_{following}
        behaviour: behaviours.greeter:reply
        qos: {{depth: 5, reliability: reliable}}
    timers:
      tick: {{period: 1.0, behaviour: behaviours.greeter:say_name, publish: text_{number}}}
      move:
        rate: 10
        publish: pace_{number}
        message: {{linear: {{x: 1.0}}, angular: {{z: 0.1}}}}
"""

Figures = dict[str, float]


def write_system(path: Path, nodes: int) -> Path:
    """Write a system of nodes with five entities each, every one of them right."""
    entries = [_NODE.format(number=each, following=(each + 1) % nodes) for each in range(nodes)]
    path.write_text('version: 1\nnodes:\n' + ''.join(entries), encoding='utf-8')
    return path


def run_command(command: str, paths: list[Path]) -> tuple[float, float, float]:
    """Return what a whole `composer COMMAND` takes: seconds, processor seconds and megabytes."""
    script = 'import sys; from composer.cli.main import main; sys.exit(main())'
    # Started anew, so that no other process counts as its memory.
    watched = (
        'import resource, subprocess, sys, time\n'
        'begun = time.perf_counter()\n'
        f'code = subprocess.call([sys.executable, "-c", {script!r}, *sys.argv[1:]],'
        ' stdout=subprocess.DEVNULL)\n'
        'print(time.perf_counter() - begun)\n'
        'used = resource.getrusage(resource.RUSAGE_CHILDREN)\n'
        'print(used.ru_utime + used.ru_stime, used.ru_maxrss)\n'
        'sys.exit(code)\n'
    )
    environment = os.environ | {'PYTHONPATH': str(ROOT)}
    done = subprocess.run(  # noqa: S603 - Composer itself
        [sys.executable, '-c', watched, command, *map(str, paths)],
        cwd=ROOT,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    seconds, cpu_seconds, kilobytes = done.stdout.split()
    return float(seconds), float(cpu_seconds), int(kilobytes) * 1024 / 1e6


def measure_files(paths: list[Path], repeats: int = _REPEATS) -> Figures:
    """Return the least time and the most memory of some runs over the same files."""
    runs = [run_command('check', paths) for _ in range(repeats)]
    seconds, cpu_seconds, megabytes = zip(*runs, strict=True)
    return {
        'seconds': min(seconds),
        'cpu_seconds': min(cpu_seconds),
        'megabytes': max(megabytes),
    }


def measure_plan(folder: Path, nodes: int) -> Figures:
    """Return the least time of a plan and of a check of such a system, measured in turn."""
    old, new = (write_system(folder / f'{each}.yaml', nodes) for each in ('old', 'new'))
    new.write_text(new.read_text().replace('rate: 10\n', 'rate: 20\n', 1))
    runs = [
        (run_command('plan', [old, new])[0], run_command('check', [new])[0])
        for _ in range(_REPEATS)
    ]
    plans, checks = zip(*runs, strict=True)
    return {'plan_seconds': min(plans), 'check_seconds': min(checks)}


def measure(side: str, size: int, _seconds: float) -> Figures:
    """Return what a check takes.

    Args:
        side: `shipped` for one small file, `many` for a hundred of `size` nodes, `one` for one
            file of `size` nodes with five times as many entities; `plan` for such a file and an
            edit of it, planned and checked.
    """
    if side == 'shipped':
        return measure_files([ROOT / 'configs' / 'greeter.yaml'])
    with tempfile.TemporaryDirectory(dir=ROOT) as folder:
        if side == 'plan':
            return measure_plan(Path(folder), size)
        count = 100 if side == 'many' else 1
        paths = [write_system(Path(folder) / f'{each}.yaml', size) for each in range(count)]
        return measure_files(paths, repeats=3)
