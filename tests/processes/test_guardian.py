"""What keeps Composer from ending is overcome, and processes of behaviours end with it."""

import os
import signal
import subprocess
import threading
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.language.pipeline import load_system_text
from composer.processes import guardian
from composer.runtime.stop import limit_stop
from tests.running import DEADLINE_SEC, ROOT, descendants, is_there

pytestmark = pytest.mark.ros

CODE = """
import ctypes
import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path

from composer.runtime import stop
from staying import stay

stop._MARGIN_SEC = 0.5

def hold_interpreter(node):
    node.logger.info('holding')
    ctypes.PyDLL(None).sleep(1000)

def flood(node):
    while True:  # composer: ignore[endless-loop]
        node.logger.info('x' * 1000)

def start(node, deaf=False):
    command = [sys.executable, '-IS', 'staying.py', *['deaf'] * deaf]
    subprocess.Popen(command)
    subprocess.Popen(['setsid', *command], env={})
    subprocess.Popen(['sh', '-c', '"$@" & exit', 'sh', *command])
    multiprocessing.Process(target=stay).start()
    multiprocessing.get_context('spawn').Process(target=stay).start()
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            stay()
        os._exit(0)

def start_once(node):
    start(node)
    again = Path(__file__).with_name('again')
    if again.exists():
        raise RuntimeError('again')
    again.touch()
"""
STAYING = """
import os
import signal
import sys
import time

def stay(deaf=False):
    if deaf:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    # In one piece: several processes write at a time.
    os.write(1, f'{os.getpid()} stays\\n'.encode())
    while True:
        time.sleep(1)

if __name__ == '__main__':
    stay(len(sys.argv) > 1)
"""
STARTED = 6
STARTING = 'version: 1\nexecutor: {{shutdown_timeout: {}}}\nnodes: {{n: {{on_start: {}}}}}\n'
HOLDING = """
version: 1
executor: {shutdown_timeout: 0.5}
nodes: {n: {timers: {t: {period: 0.02, behaviour: 'parts:hold_interpreter'}}}}
"""


@pytest.fixture
def compose(compose):
    """Let behaviours find the module of what they start."""
    (compose.folder / 'staying.py').write_text(STAYING)
    return compose


def started_by(child):
    """Return the processes that the behaviour has started."""
    child.wait_for_line(' stays', times=STARTED)
    child.wait_until_ready()
    return {int(line.split()[-2]) for line in child.matching(' stays')}


def worker_of(child):
    """Return the process of the only worker of a system; those that it forks come after it."""
    commands = {pid: Path(f'/proc/{pid}/cmdline').read_bytes() for pid in descendants(child.pid)}
    return next(pid for pid, each in commands.items() if b'worker_program.py' in each)


def guardian_of(child):
    """Return the process that guards a system."""
    composer = str(child.pid).encode()
    for folder in Path('/proc').glob('[0-9]*'):
        try:
            command = (folder / 'cmdline').read_bytes().split(b'\0')
        except OSError:
            continue
        if any(word.endswith(b'/guardian.py') for word in command) and composer in command:
            return int(folder.name)
    return None


def test_a_process_that_was_told_to_end_has_not_crashed(capfd):
    """It may end right after the signal: the guardian learns of both at once."""
    with subprocess.Popen(['true']) as process:
        ended = os.pidfd_open(process.pid)
    reports, descriptor = os.pipe()
    os.write(descriptor, bytes([signal.SIGINT]))

    assert guardian.Guardian(ended, reports, 10.0, 10.0).run()
    assert capfd.readouterr().err == ''
    for each in (ended, reports, descriptor):
        os.close(each)


def test_a_stop_may_take_as_long_as_was_told_last(capfd):
    """The bytes of the time mean nothing else, and may come in two pieces."""
    with subprocess.Popen(['sleep', '1000']) as process:
        reports, descriptor = os.pipe()
        watching = guardian.Guardian(os.pidfd_open(process.pid), reports, 1000.0, 10.0)
        told = bytes([guardian.LIMIT]) + guardian.SECONDS.pack(0.01)
        watching._take_all(told[:4])
        os.write(descriptor, told[4:] + bytes([guardian.BEGUN]))
        assert watching.run()
    assert 'the system did not end in time' in capfd.readouterr().err


def test_silence_is_reported_unless_the_process_is_stopped(capfd, monkeypatch, wait_for):
    monkeypatch.setattr(guardian, '_LOOK_SEC', 0.01)
    looks, read_state = [], guardian._read_state

    def note_look(pid):
        looks.append(read_state(pid))
        return looks[-1]

    monkeypatch.setattr(guardian, '_read_state', note_look)
    with subprocess.Popen(['sleep', '1000']) as process:
        process.send_signal(signal.SIGSTOP)
        wait_for(lambda: read_state(process.pid) == b'T', 'its stop')
        reports, descriptor = os.pipe()
        os.write(descriptor, bytes([guardian.BEAT]))
        watching = guardian.Guardian(os.pidfd_open(process.pid), reports, 1.0, 1.0)
        thread = threading.Thread(target=watching.run)
        thread.start()
        wait_for(lambda: len(looks) > 2 * guardian._SILENT_LOOKS, 'looks at it')
        assert capfd.readouterr().err == ''
        # The signal that has Composer print its stacks ends this process.
        process.send_signal(signal.SIGCONT)
        thread.join(DEADLINE_SEC)
    assert ' a behaviour keeps the interpreter from all others' in capfd.readouterr().err


def test_a_call_that_holds_the_interpreter_is_reported(compose, wait_for):
    code = CODE.replace('sleep(1000)', "sleep(8)\n    node.logger.info('went on')")
    child = compose(STARTING.format(5, 'parts:hold_interpreter'), code)
    child.wait_for_line('went on')
    told = ('not answered for 5 s', 'in hold_interpreter', 'went on')
    places = [next(n for n, line in enumerate(child.lines) if each in line) for each in told]
    assert places == sorted(places)
    child.wait_for_line('[INFO] [composer]: the system answers again')
    child.wait_until_ready()
    guardian = guardian_of(child)

    assert child.stop() == 0
    wait_for(lambda: not is_there(guardian), 'its end')


def test_a_process_that_holds_the_interpreter_is_killed(compose):
    child = compose(HOLDING, CODE)
    child.wait_for_line('holding')
    child.send(signal.SIGTERM)

    assert child.wait() == -signal.SIGKILL
    assert child.matching('the system did not end in time')
    assert child.matching('in hold_interpreter')


def test_output_that_blocks_does_not_keep_the_process_alive(compose, start_program, wait_for):
    text = HOLDING.replace('hold_interpreter', 'flood')
    process = start_program(
        *('-m', 'composer', 'up', compose.write(text, CODE).name),
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_DOMAIN_ID': str(compose.domain_id)},
        stderr=subprocess.PIPE,
    )
    assert ' ready in ' in process.stderr.readline()
    wait_for(lambda: 'pipe_write' in stack_of(process.pid), 'a full pipe')
    process.send_signal(signal.SIGINT)

    assert process.wait(DEADLINE_SEC) == -signal.SIGKILL


def stack_of(pid):
    """Return what the kernel does for the threads of a process."""
    return ' '.join(
        path.read_text() for path in Path(f'/proc/{pid}/task').glob('*/wchan') if path.exists()
    )


def test_processes_of_behaviours_of_a_worker_end_with_the_system(compose):
    child = compose(STARTING.format(30, 'parts:start').replace('on_', 'worker: w, on_'), CODE)
    pids = started_by(child)

    assert child.stop() == 0
    assert not any(map(is_there, pids))
    for pid in pids:
        assert child.matching(f'process {pid} (')
    assert len(child.matching('which a behaviour has started, still runs')) >= STARTED
    assert not child.matching('resource_tracker')


def test_a_stop_may_take_as_long_as_all_that_gets_time_in_it():
    text = """
version: 1
executor: {shutdown_timeout: 60}
nodes: {n: {}}
processes: {p: {command: [sleep, '9'], stop: {timeout: 30}}}
"""
    spec = load_system_text(text).spec
    # Callbacks, then processes, then what behaviours have started and left.
    assert limit_stop(spec, ends_process=True) > 60 + 30 + 60


def test_processes_of_behaviours_that_do_not_end_are_killed(compose):
    start = "{behaviour: 'parts:start', with: {deaf: true}}"
    child = compose(STARTING.format(2, start), CODE)
    pids = started_by(child)

    assert child.stop() == 1
    assert not any(map(is_there, pids))
    assert len(child.matching(' outlived the system: killed')) == 3


def test_processes_of_behaviours_end_with_a_system_that_is_killed(compose, wait_for):
    child = compose(STARTING.format(30, 'parts:start'), CODE)
    pids = started_by(child)
    child.send(signal.SIGKILL)

    wait_for(lambda: not any(map(is_there, pids)), 'their end')
    for pid in pids:
        assert child.wait_for_line(f'process {pid} (').endswith(' outlived the system: killed')


def test_processes_of_behaviours_end_with_a_worker_that_cannot_start_again(compose, wait_for):
    text = STARTING.format(30, 'parts:start_once').replace('on_', 'worker: w, on_')
    child = compose(text + 'workers: {w: {restart: {delay: 0.1, max: 1}}}\n', CODE)
    started_by(child)
    os.kill(worker_of(child), signal.SIGKILL)

    # Those of the second start; some of them end before they say anything.
    child.wait_for_line(" outlived worker 'w': killed", times=STARTED + 1)
    pids = {int(line.split()[-2]) for line in child.matching(' stays')}
    wait_for(lambda: not any(map(is_there, pids)), 'their end')
    assert child.stop() == 0


def test_processes_of_a_program_that_calls_up_are_its_own(compose, start_program):
    text = "version: 1\nnodes: {n: {on_start: 'parts:start'}}\n"
    code = """
        import subprocess
        import sys

        started = []

        def start(node):
            started.append(subprocess.Popen([sys.executable, '-c', 'input()'], stdin=-1))
            node.shutdown()
    """
    program = """
import sys
import composer
assert composer.up(sys.argv[1]) == 0
from parts import started
print(started[0].poll())
started[0].communicate(b'.')
"""
    process = start_program(
        *('-c', program, compose.write(text, code).name),
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': f'{ROOT}:.', 'ROS_DOMAIN_ID': str(compose.domain_id)},
    )
    output, _ = process.communicate(timeout=DEADLINE_SEC)
    assert (process.returncode, output.splitlines()[-1]) == (0, 'None')


def test_the_guardian_of_a_service_ends_before_it(compose):
    """What is left when the main process has ended, systemd kills, and says so."""
    code = "import os\n\nos.environ['SYSTEMD_EXEC_PID'] = str(os.getpid())\n\ndef tick(node):\n    pass\n"
    system = "version: 1\nnodes: {n: {timers: {t: {period: 0.1, behaviour: 'parts:tick'}}}}\n"
    child = compose(system, code)
    child.wait_until_ready()
    guarding = guardian_of(child)
    assert is_there(guarding)
    child.send(signal.SIGTERM)
    # Its output ends with the guardian.
    code = child._process.wait(DEADLINE_SEC)
    assert not is_there(guarding)
    assert code == 0
