"""External processes: their environment and output, and that none is left at the end."""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from itertools import islice
from pathlib import Path
from textwrap import dedent

import pytest

pytest.importorskip('rclpy')

from rclpy.node import NodeNameNonExistentError

from tests.running import DEADLINE_SEC

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]

# Programs that are hard to get rid of; all carry the path of this file in their command lines.
STUBBORN = """
import os, signal, sys, time

def stay():
    print(kind, 'is there', flush=True)
    while True:
        time.sleep(1)

kind = sys.argv[1]
if kind == 'family' and os.fork() == 0 and os.fork() == 0:
    stay()
if kind == 'daemon':
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            stay()
        os._exit(0)
    os.wait()
    os._exit(0)
if kind == 'nameless':
    if os.fork() == 0:
        os.setsid()
        os.execve(sys.executable, [sys.executable, '-I', '-S', __file__, 'plain'], {})
    kind = 'parent of nameless'
if kind == 'deaf':
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
if kind == 'asleep':
    print(kind, 'is there', flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
if kind == 'mute':
    print(kind, 'is there', flush=True)
    for descriptor in (0, 1, 2):
        os.close(descriptor)
    while True:
        time.sleep(1)
stay()
"""
KINDS = ('plain', 'family', 'daemon', 'nameless', 'deaf', 'asleep', 'mute')
# What the processes of a kind call themselves, where it has several.
PROCESSES_OF = {'family': ['family'] * 3, 'nameless': ['parent of nameless', 'plain']}


class Stubborn:
    """Systems of stubborn programs, and what is left of them."""

    def __init__(self, folder):
        self.path = folder / 'stubborn.py'
        self.path.write_text(STUBBORN)

    def process(self, kind, **keys):
        command = [sys.executable, '-I', '-S', str(self.path), kind]
        return {kind: {'command': command, **keys}}

    def left(self):
        return {
            pid: words
            for pid, words in command_lines().items()
            if str(self.path).encode() in words
        }


def command_lines():
    found = {}
    for entry in Path('/proc').iterdir():
        if entry.name.isdecimal():
            try:
                found[int(entry.name)] = (entry / 'cmdline').read_bytes()
            except OSError:
                continue
    return found


def children(pid):
    found = []
    for entry in Path(f'/proc/{pid}/task').iterdir():
        # A thread may end between two looks.
        with suppress(OSError):
            found += map(int, (entry / 'children').read_text().split())
    return found


def reapers(child):
    """Return the reaper of a system, and the second one, which is its parent."""

    def among_children(parent):
        lines = command_lines()
        return [pid for pid in children(parent) if b'processes/reaper.py' in lines.get(pid, b'')]

    (second,) = among_children(child._process.pid)
    (reaper,) = among_children(second)
    return reaper, second


def system(processes, nodes=None, **keys):
    """Return a system in JSON, which is YAML."""
    data = {'version': 1, 'diagnostics': False, 'processes': processes, **keys}
    if nodes is not None:
        data['nodes'] = nodes
    return json.dumps(data, ensure_ascii=False)


def shell(command):
    return ['sh', '-c', command]


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """Return the folder for what is temporary."""
    folder = tmp_path / 'scratch'
    folder.mkdir()
    monkeypatch.setenv('TMPDIR', str(folder))
    return folder


@pytest.fixture
def stubborn(tmp_path, wait_for):
    stubborn = Stubborn(tmp_path)
    yield stubborn
    for pid in stubborn.left():
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def compose_stubborn(compose, stubborn, kinds=KINDS, **keys):
    processes = {}
    for kind in kinds:
        # Only one that hears nothing needs to be killed: the others get the time that they need.
        patience = {'stop': {'timeout': 1.0}} if kind == 'deaf' else {}
        processes |= stubborn.process(kind, **patience)
    child = compose(system(processes, **keys))
    # Python loses a SIGINT now and then while it starts: all of their processes have to be there.
    awaited = Counter(line for kind in kinds for line in PROCESSES_OF.get(kind, [kind]))
    for name, times in awaited.items():
        child.wait_for_line(f'] {name} is there', times=times)
    child.wait_until_ready()
    assert len(stubborn.left()) >= len(kinds)
    return child


def test_nothing_is_left_after_a_clean_stop(compose, stubborn):
    child = compose_stubborn(compose, stubborn, executor={'shutdown_timeout': 30.0})

    assert child.stop() == 1, 'one had to be killed'
    assert stubborn.left() == {}
    (killed,) = child.matching('is killed')
    assert killed == (
        "[ERROR] [composer]: process 'deaf' did not end within 1 s of SIGINT, and is killed"
    )
    assert child.matching("process 'asleep' was ended by SIGINT")


def test_processes_are_stopped_by_the_signal_that_they_want_or_by_sigterm(compose):
    """Many programs lose a SIGINT that comes while they start; none should be killed for that."""
    wanted = {'polite': 'SIGTERM', 'user': 'SIGUSR2', 'short': 'SIGKILL'}
    processes = {
        name: {'command': shell('echo here; exec sleep 3600'), 'stop': {'signal': signal_name}}
        for name, signal_name in wanted.items()
    }
    processes |= {
        name: {'command': shell(f'trap "" {lost}; echo here; sleep 1000'), 'stop': stop}
        for name, lost, stop in (
            ('late', 'INT', {}),
            ('hung', 'HUP', {'signal': 'SIGHUP', 'timeout': 4.0}),
        )
    }
    asking = 'trap "echo asked; exit 0" INT; echo here; while :; do sleep 0.05; done'
    processes['asked'] = {'command': shell(asking)}
    nodes = {'n': {'on_stop': 'parts:tell'}}
    code = "def tell(node):\n    node.logger.info('on_stop')\n"
    child = compose(system(processes, nodes, executor={'shutdown_timeout': 2.0}), code)
    for name in processes:
        child.wait_for_line(f'[{name}] here')
    child.wait_until_ready()

    assert child.stop() == 0, child.output
    # Nodes are the first to stop.
    ends = ('[INFO] [n]: on_stop', '[asked] asked')
    stopping = [line for line in child.lines if line in ends or ' ended ' in line]
    assert stopping[0] == ends[0]
    asked = stopping.index(ends[1])
    assert "[INFO] [composer]: process 'asked' has ended with exit code 0" in stopping[asked:]
    assert sorted(child.matching(' was ended by ')) == sorted(
        f"[INFO] [composer]: process '{name}' was ended by {signal_name}"
        for name, signal_name in {**wanted, 'late': 'SIGTERM', 'hung': 'SIGTERM'}.items()
    )
    assert sorted(child.matching('gets SIGTERM')) == [
        "[WARN] [composer]: process 'hung' did not end within 2 s of SIGHUP, and gets SIGTERM",
        "[WARN] [composer]: process 'late' did not end within 1 s of SIGINT, and gets SIGTERM",
    ]


def test_nothing_is_left_after_a_second_signal(compose, stubborn):
    child = compose_stubborn(compose, stubborn, executor={'shutdown_timeout': 3600})
    child.send(signal.SIGINT)
    child.wait_for_line("process 'plain' was ended by SIGINT")
    child.send(signal.SIGTERM)

    # Nobody is left to hold its output by the time that it ends itself.
    assert child._process.wait(DEADLINE_SEC) == 1
    assert stubborn.left() == {}


def test_nothing_is_left_after_the_death_of_composer(compose, stubborn, wait_for, scratch):
    child = compose_stubborn(compose, stubborn)
    helpers = reapers(child)
    child.stop(signal.SIGKILL)

    wait_for(lambda: not stubborn.left(), 'the end of all processes')
    wait_for(lambda: not {*helpers} & {*command_lines()}, 'the end of the reapers')
    assert list(scratch.iterdir()) == []


def test_nothing_is_left_after_the_death_of_composer_and_the_reaper(
    compose, stubborn, wait_for, scratch
):
    child = compose_stubborn(compose, stubborn)
    reaper, _ = reapers(child)
    os.kill(reaper, signal.SIGSTOP)
    child.send(signal.SIGSTOP)
    os.kill(reaper, signal.SIGKILL)
    child.stop(signal.SIGKILL)

    wait_for(lambda: not stubborn.left(), 'the end of all processes')
    wait_for(lambda: not list(scratch.iterdir()), 'the end of what is temporary')


def test_a_process_dies_with_composer_and_both_reapers(compose, stubborn, wait_for):
    child = compose_stubborn(compose, stubborn, ['plain', 'deaf', 'asleep', 'mute'])
    reaper, second = reapers(child)
    child.send(signal.SIGSTOP)
    for pid in (reaper, second):
        os.kill(pid, signal.SIGSTOP)
    for pid in (second, reaper):
        os.kill(pid, signal.SIGKILL)
    child.stop(signal.SIGKILL)

    wait_for(lambda: not stubborn.left(), 'the end of all processes')


def test_the_death_of_the_reaper_ends_the_system(compose, stubborn):
    child = compose_stubborn(compose, stubborn)
    reaper, _ = reapers(child)
    os.kill(reaper, signal.SIGKILL)

    assert child.wait() == 1
    assert child.matching('the process reaper was killed, and all external processes with it')
    assert stubborn.left() == {}


def test_the_second_reaper_is_not_needed_for_a_clean_stop(compose, stubborn, wait_for):
    child = compose_stubborn(compose, stubborn, ['plain', 'daemon', 'nameless'])
    reaper, second = reapers(child)
    os.kill(second, signal.SIGKILL)

    assert child.stop() == 0
    assert stubborn.left() == {}
    wait_for(lambda: reaper not in command_lines(), 'the end of the reaper')


@pytest.fixture(scope='module')
def short_lived(shared_compose):
    """Run a system of processes that print something and end."""
    printing = r"""
        printf 'one\ntwo\r\n\nbin\377ary\303\244\n' >&2
        printf 'begun '; sleep 0.2; printf 'and ended\nlast words'
    """
    listing = (
        'import os, sys; print(sorted(os.listdir("/proc/self/fd"))[:-1], repr(sys.stdin.read()))'
    )
    (shared_compose.folder / 'inner').mkdir()
    processes = {
        # Python ignores SIGPIPE, and the reaper SIGINT and SIGTERM.
        'signals': {'command': shell('grep -E "^Sig(Ign|Blk)" /proc/self/status')},
        'lines': {'command': shell(dedent(printing))},
        'folder': {
            'command': shell('pwd; echo "$MODE $COUNT $SHARED $FLAG"'),
            'cwd': 'inner',
            'env': {'MODE': 'fast', 'COUNT': 3, 'FLAG': True},
        },
        'prefix': {'command': ['python3', '-c', 'import sys; print(sys.prefix)']},
        'descriptors': {'command': [sys.executable, '-I', '-S', '-c', listing]},
    }
    child = shared_compose(system(processes, environment={'SHARED': 'all', 'MODE': 'slow'}))
    assert child.wait() == 0
    return child


def test_a_system_without_nodes_ends_with_its_last_process(short_lived):
    assert short_lived.matching(' ready in ')
    assert len(short_lived.matching(' has ended with exit code 0')) == 5
    assert short_lived.lines[-1] == '[INFO] [composer]: all processes have ended: the system ends'


def test_signals_that_composer_ignores_reach_the_process(short_lived):
    masks = [int(line.split()[-1], 16) for line in short_lived.matching('[signals] Sig')]
    # Those above 31 are of libc and of real time: whoever started the tests may have set them.
    assert [mask & 0x7FFFFFFF for mask in masks] == [0, 0]


def test_every_line_of_the_output_has_the_name_in_front(short_lived):
    assert short_lived.matching('[lines]') == [
        '[lines] one',
        '[lines] two',
        '[lines] ',
        '[lines] bin\\xffaryä',
        '[lines] begun and ended',
        '[lines] last words',
    ]


def test_a_flood_of_output_without_end_of_line_is_not_kept(compose):
    code = """
        import resource

        def tell(node):
            node.logger.info(f'{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024} MB')
    """
    million = 8
    flood = shell(f"head -c {million}000000 /dev/zero | tr '\\0' '#'")
    nodes = {'n': {'on_start': 'parts:tell', 'on_stop': 'parts:tell'}}
    child = compose(system({'driver': {'command': flood}}, nodes), code)
    child.wait_for_line("process 'driver' has ended with exit code 0")

    assert child.stop() == 0
    assert child.output.count('#') == million * 1_000_000
    before, after = (int(line.split()[-2]) for line in child.matching(' MB'))
    assert after - before < 7


def test_output_that_nobody_takes_does_not_keep_the_system_from_stopping(compose, start_program):
    code = """
        def tell(node):
            node.logger.info('tick')
    """
    nodes = {'n': {'timers': {'t': {'period': 0.05, 'behaviour': 'parts:tell'}}}}
    path = compose.write(system({'flood': {'command': ['yes', 'flood']}}, nodes), code)
    process = start_program(
        *('-m', 'composer', 'up', path.name),
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(compose.folder)},
        stderr=subprocess.PIPE,
    )
    lines = iter(process.stderr.readline, '')
    ticks = (line for line in lines if 'tick' in line)
    assert len(list(islice(ticks, 20))) == 20
    process.send_signal(signal.SIGINT)

    assert process.wait(DEADLINE_SEC) == 0
    assert process.stdout.readline() == '[flood] flood\n'


def test_ends_are_told_and_processes_started_again_as_the_file_says(compose):
    """The system ends with the last process that is not started again."""
    cases = {
        'good': ('never', 'exit 0', 0, 0),
        'bad': ('never', 'exit 3', 0, 0),
        'crash': ('never', 'kill -SEGV $$', 0, 0),
        'well': ('on_failure', 'exit 0', 0, 0),
        'killed': ('on_failure', 'kill -9 $$', 0.3, 1),
        'slower': ('on_failure', 'exit 1', 0, 3),
    }
    processes = {
        name: {
            'command': shell(f'echo run; {end}'),
            'restart': {'when': when, 'delay': delay, 'max': max(1, more)},
        }
        for name, (when, end, delay, more) in cases.items()
    }
    child = compose(system(processes))

    assert child.wait() == 1
    for name, (*_, more) in cases.items():
        assert len(child.matching(f'[{name}] run')) == 1 + more
    end = "[ERROR] [composer]: process 'slower' has ended with exit code 1"
    assert child.matching("process 'slower'") == [
        f'{end}; it is started again in 0.1 s',
        f'{end}; it is started again in 0.2 s',
        f'{end}; it is started again in 0.4 s',
        f'{end}, and was started again 3 times already',
    ]
    for line in (
        "[INFO] [composer]: process 'good' has ended with exit code 0",
        "[ERROR] [composer]: process 'bad' has ended with exit code 3",
        "[ERROR] [composer]: process 'crash' was ended by SIGSEGV",
    ):
        assert line in child.lines
    assert child.matching("process 'killed' was ended by SIGKILL; it is started again in 0.3 s")


def test_the_end_of_a_process_may_end_the_system(compose):
    """One that ends well, too, as those of `test_many_systems_in_a_row_leave_nothing_behind`."""
    processes = {
        'mission': {'command': shell('kill -9 $$'), 'on_exit': 'shutdown'},
        'other': {'command': ['sleep', '3600']},
    }
    child = compose(system(processes))

    assert child.wait() == 1
    child.wait_for_line("process 'mission' was ended by SIGKILL, so the system ends")
    assert len(child.matching("process 'mission'")) == 1
    child.wait_for_line("process 'other' was ended by SIGINT")


def test_a_process_that_cannot_be_started_ends_the_start(compose, stubborn):
    empty = compose.folder / 'empty.bin'
    empty.write_bytes(b'\x7fnothing')
    empty.chmod(0o755)
    processes = {'driver': {'command': ['./empty.bin']}}
    child = compose(system(stubborn.process('plain') | processes))

    assert child.wait() == 1
    # The other program may be told to end while its Python starts, and says so.
    (line,) = [each for each in child.matching('error: ') if not each.startswith('[plain]')]
    assert line.startswith("error: process 'driver'")
    assert "cannot be started: './empty.bin': Exec format error" in line
    assert not child.matching(' ready in ')
    assert stubborn.left() == {}


def test_a_process_runs_in_its_folder_with_its_environment(short_lived, shared_compose):
    assert short_lived.matching('[folder]') == [
        f'[folder] {(shared_compose.folder / "inner").resolve()}',
        '[folder] fast 3 all true',
    ]


def test_python_is_that_of_composer_where_that_has_an_environment_of_its_own(short_lived):
    assert short_lived.matching('[prefix]') == [f'[prefix] {sys.prefix}']


def test_a_process_has_no_descriptors_of_composer_and_nothing_to_read(short_lived):
    assert short_lived.matching('[descriptors]') == ["[descriptors] ['0', '1', '2'] ''"]


def test_a_behaviour_that_forks_keeps_nothing_from_ending(compose, stubborn):
    code = """
        import os
        import time

        def fork(node):
            composer = os.getpid()
            if os.fork() == 0:
                while os.getppid() == composer:
                    time.sleep(0.05)
                os._exit(0)
            node.logger.info('forked')
    """
    nodes = {'n': {'on_start': 'parts:fork'}}
    processes = stubborn.process('plain') | {
        'again': {'command': ['true'], 'restart': {'when': 'always', 'delay': 0.1, 'max': 2}}
    }
    child = compose(system(processes, nodes), code)
    child.wait_for_line('forked')
    child.wait_for_line('2 times already')

    assert child.stop() == 0
    assert stubborn.left() == {}


EXTERNAL_NODE = """#!{python}
import sys
import rclpy
from rclpy.parameter import Parameter
from std_msgs.msg import String

rclpy.init(args=sys.argv)
node = rclpy.create_node('own_name', automatically_declare_parameters_from_overrides=True)
node.create_publisher(String, 'chatter', 1)
node.create_publisher(String, 'gossip', 1)
node.create_publisher(String, '~/private', 1)
print('arguments', *sys.argv[1:2], flush=True)
print('level', node.get_logger().get_effective_level().name, flush=True)
rclpy.spin(node)
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return the share folder of a package `vendor` with an executable `driver`."""
    prefix = tmp_path / 'prefix'
    for folder in ('share/ament_index/resource_index/packages', 'lib/vendor', 'share/vendor'):
        (prefix / folder).mkdir(parents=True)
    (prefix / 'share/ament_index/resource_index/packages/vendor').touch()
    program = prefix / 'lib/vendor/driver'
    program.write_text(EXTERNAL_NODE.format(python=sys.executable))
    program.chmod(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    return prefix / 'share/vendor'


def parameters_of(peer, node):
    from rcl_interfaces.srv import GetParameters, ListParameters
    from rclpy.parameter import parameter_value_to_python

    names = sorted(peer.call(ListParameters, f'{node}/list_parameters').result.names)
    values = peer.call(GetParameters, f'{node}/get_parameters', names=names).values
    return {
        name: parameter_value_to_python(value) for name, value in zip(names, values, strict=True)
    }


def published_by(peer, node, namespace):
    """Return the topics of a node; none if nothing is known of it yet, though it may answer."""
    with suppress(NodeNameNonExistentError):
        return dict(peer.node.get_publisher_names_and_types_by_node(node, namespace)).keys()
    return set()


def plain(value):
    return value.tolist() if hasattr(value, 'tolist') else value


OF_EVERY_NODE = {'use_sim_time', 'start_type_description_service'}
PARAMETERS = {
    'flag': True,
    'count': 3,
    'negative': -(2**62),
    'ratio': 1.0,
    'huge': 1e22,
    'label': 'twelve',
    'yes': 'yes',
    'digits': '012',
    'float_text': '1e3',
    'hex_text': '0x1F',
    'null_text': 'null',
    'empty_text': '',
    'colon': 'a: b # c',
    'lines': 'one\ntwo\t"three"',
    'smile': 'ä 😀',
    'flags': [True, False],
    'counts': [1, 2],
    'mixed': [1, 2.5],
    'labels': ['a', 'yes', '3'],
    'nested': {'deep': {'er': 0.5}},
    'dotted.name': 'dots',
}


def test_an_executable_of_a_package_gets_all_that_the_file_says(compose, peer, package, wait_for):
    """The command line wins over it."""
    (package / 'defaults.yaml').write_text(
        '/**: {ros__parameters: {from_package: 1.5, count: 4, label: package}}'
    )
    (compose.folder / 'own.yaml').write_text(
        '/robot/renamed: {ros__parameters: {label: own file}}\n'
        '/elsewhere: {ros__parameters: {label: of another}}\n'
    )
    (compose.folder / 'more.yaml').write_text('/**: {ros__parameters: {from_line: 0.5}}')
    driver = {
        'package': 'vendor',
        'executable': 'driver',
        'cwd': '/',
        'arguments': ['--fast'],
        'name': 'renamed',
        'namespace': '/robot',
        'parameters': PARAMETERS | {'given': 'file'},
        'parameter_files': ['package://vendor/defaults.yaml', 'own.yaml'],
        'remap': {'chatter': '/elsewhere/words', 'gossip': 'file'},
        'log_level': 'warn',
    }
    processes = {
        'driver': driver,
        'other': {'package': 'vendor', 'executable': 'driver'},
        'third': {'package': 'vendor', 'executable': 'driver', 'name': 'third', 'namespace': '/'},
        'echo': {'command': ['echo', 'nothing', 'else']},
    }
    defaults = {'namespace': 'fleet', 'use_sim_time': True, 'log_level': 'error'}
    path = compose.write(system(processes, defaults=defaults))
    words = ['-p', 'given:=line', '-r', 'gossip:=line', '--params-file', 'more.yaml']
    child = compose.run(path.name, '--log-level', '/third:=debug', '--ros-args', *words)

    assert child.wait_for_line('[driver] arguments') == '[driver] arguments --fast'
    assert child.wait_for_line('[driver] level') == '[driver] level WARN'
    # What the file says of all holds for the executable that says nothing, and for no command.
    assert child.wait_for_line('[other] level') == '[other] level ERROR'
    assert child.wait_for_line('[third] level') == '[third] level DEBUG'
    assert child.wait_for_line('[echo]') == '[echo] nothing else'
    assert parameters_of(peer, '/fleet/own_name')['use_sim_time'] is True
    values = parameters_of(peer, '/robot/renamed')
    got = {name: values[name] for name in values.keys() - OF_EVERY_NODE}
    expected = PARAMETERS | {'count': 4, 'label': 'own file', 'from_package': 1.5}
    expected |= {'given': 'line', 'from_line': 0.5}
    expected |= {'mixed': [1.0, 2.5], 'nested.deep.er': 0.5}
    del expected['nested']
    assert {name: plain(value) for name, value in got.items()} == expected
    assert {name: type(plain(value)) for name, value in got.items()} == {
        name: type(value) for name, value in expected.items()
    }
    expected = {'/elsewhere/words', '/robot/renamed/private', '/robot/line'}
    wait_for(lambda: expected <= published_by(peer, 'renamed', '/robot'), 'the topics')
    assert child.stop() == 0


def test_many_systems_in_a_row_leave_nothing_behind(compose, stubborn, scratch):
    processes = stubborn.process('daemon') | {
        'mission': {
            'command': shell('echo done; sleep 0.2'),
            'on_exit': 'shutdown',
            'parameters': {'a': 1},
        }
    }
    path = compose.write(system(processes))
    program = """
        import json, os, sys, tempfile, threading, time
        import composer

        def count():
            return [len(os.listdir(f'/proc/self/{kind}')) for kind in ('task', 'fd')]

        composer.up(sys.argv[1])
        before = count()
        codes = [composer.up(sys.argv[1])]
        # A thread that has been joined may take a moment to leave the kernel's list.
        deadline = time.monotonic() + 20
        while any(now > then for now, then in zip(count(), before)):
            if time.monotonic() > deadline:
                break
            time.sleep(0.01)
        left = [name for name in os.listdir(tempfile.gettempdir()) if name.startswith('composer-')]
        print(json.dumps([codes, before, count(), left, threading.active_count()]))
    """
    result = subprocess.run(
        [sys.executable, '-c', dedent(program), path.name],
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(compose.folder)},
        stdout=subprocess.PIPE,
        text=True,
        timeout=200,
        check=True,
    )
    *lines, last = result.stdout.splitlines()
    codes, before, after, left, threads = json.loads(last)

    assert lines.count('[mission] done') == 2
    assert codes == [0]
    assert all(now <= then for now, then in zip(after, before, strict=True)), (before, after)
    assert left == []
    assert threads == 1
    assert stubborn.left() == {}
