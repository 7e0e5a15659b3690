"""What tests of running systems share: a ROS domain, Composer in a child process, a plain peer."""

import os
import re
import select
import signal
import socket
import subprocess
import threading
import time
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from itertools import count, islice
from pathlib import Path
from textwrap import dedent

import pytest

from tests.fork_server import start_composer

ROOT = Path(__file__).resolve().parent.parent
DEADLINE_SEC = 90.0
PATIENCE_SEC = 8.0

# Domains of DDS whose ports lie below the range that Linux gives to outgoing connections.
_FIRST_DOMAIN, _DOMAINS = 10, 91
# Threads of behaviours have the names that Python gives them.
_DEAD = re.compile(r'Exception in thread (?!Thread-\d+ \((?!_))')
_domain_offsets = count(os.getpid() * 7)
_peers = []


_PAUSE_SEC = 0.01


def wait_for(condition, what, timeout_sec=DEADLINE_SEC):
    """Return the first true result of `condition`; fail after a deadline, or as a peer has.

    `what` may be a function: what it returns then shows how it was at the deadline.
    """
    deadline = (looked := time.monotonic()) + timeout_sec
    while not (result := condition()):
        for peer in _peers:
            peer.check()
        if time.monotonic() > deadline:
            known = ''.join(f'; the peer knows {each.known()}' for each in _peers)
            pytest.fail(f'in vain waited for {what() if callable(what) else what}{known}')
        # What is dear to look at, as a page, is not looked at all the time.
        time.sleep(min(max(_PAUSE_SEC, 3 * (time.monotonic() - looked)), 5 * _PAUSE_SEC))
        looked = time.monotonic()
    return result


def descendants(pid):
    """Return the IDs of all processes that a process has started, and they in turn."""
    parents = {}
    for folder in Path('/proc').iterdir():
        with suppress(OSError, ValueError):
            fields = (folder / 'stat').read_bytes().rpartition(b')')[2].split()
            parents.setdefault(int(fields[1]), []).append(int(folder.name))
    found, pending = [], [pid]
    while pending:
        below = parents.get(pending.pop(), [])
        found += below
        pending += below
    return found


def is_there(pid):
    """Return whether a process runs."""
    with suppress(OSError):
        return Path(f'/proc/{pid}/stat').read_bytes().rpartition(b')')[2].split()[0] != b'Z'
    return False


@contextmanager
def reserved_domain():
    """Return a ROS domain that no process is in, and that no other run of tests takes meanwhile."""
    with ExitStack() as reserved:
        domain = next(domain for domain in _domains() if _reserve(domain, reserved))
        yield domain


def _domains():
    for offset in islice(_domain_offsets, _DOMAINS):
        yield _FIRST_DOMAIN + offset % _DOMAINS
    pytest.fail('every ROS domain is in use')


def _reserve(domain, reserved):
    """Return whether a domain is free; it is held until `reserved` ends."""
    sign = reserved.enter_context(socket.socket(socket.AF_UNIX))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            sign.bind(f'\0composer-tests-domain-{domain}')
            # The port that all participants of a domain share.
            probe.bind(('', 7400 + 250 * domain))
        except OSError:
            return False
    return True


class Child:
    """A command of Composer in a process of its own, with all that it has printed so far."""

    def __init__(self, arguments, folder, domain_id, log_folder):
        environment = os.environ | {
            'ROS_DOMAIN_ID': str(domain_id),
            'ROS_LOG_DIR': str(log_folder),
            'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{name}]: {message}',
            'RCUTILS_COLORIZED_OUTPUT': '0',
            'PYTHONUNBUFFERED': '1',
            'PYTHONPATH': os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')]),
        }
        self._lines = []
        # Of other commands nobody waits for that.
        self._up = str(arguments[0]) != 'up'
        self._grown = threading.Condition()
        self._ended = False
        self._rest = b''
        self._process = start_composer(map(str, arguments), folder, environment)
        # A read never waits: who looks for lines reads them, too.
        self._output = self._process.stdout.fileno()
        os.set_blocking(self._output, False)
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    @property
    def pid(self):
        return self._process.pid

    @property
    def output(self):
        return '\n'.join(self.lines)

    @property
    def lines(self):
        """All that it has printed until now."""
        self._take_lines()
        return self._lines

    def matching(self, part):
        return [line for line in self.lines if part in line]

    def wait_for_line(self, part, *, times=1):
        """Return the line that contains `part`, or the last of as many as are wanted."""

        def arrived():
            return len(self.matching(part)) >= times

        with self._grown:
            self._grown.wait_for(lambda: arrived() or self._ended, DEADLINE_SEC)
        if not arrived():
            pytest.fail(f'{times} x {part!r} did not come; the output was\n{self.output}')
        return self.matching(part)[times - 1]

    def wait_until_ready(self):
        return self.wait_for_line(' ready in ')

    def send(self, number):
        self._process.send_signal(number)

    def wait(self):
        """Return the exit code."""
        try:
            code = self._process.wait(DEADLINE_SEC)
        except subprocess.TimeoutExpired:
            pytest.fail(f'it did not end; the output was\n{self.output}')
        self._reader.join(DEADLINE_SEC)
        return code

    def stop(self, number=signal.SIGINT, *, once_up=True):
        """Send a signal, to a system once it is up, and return the exit code."""
        with self._grown:
            if not self._grown.wait_for(
                lambda: self._up or self._ended or not once_up, DEADLINE_SEC
            ):
                pytest.fail(f'it was not up in time; the output was\n{self.output}')
        self.send(number)
        return self.wait()

    def end(self):
        """End it as a user does, if need be by force, which leaves shared memory behind."""
        for number in (signal.SIGINT, signal.SIGKILL):
            self._process.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE_SEC)
        self._reader.join()
        self._process.stdout.close()

    def _read(self):
        printing = select.poll()
        printing.register(self._output, select.POLLIN)
        while not self._ended:
            printing.poll()
            self._take_lines()

    def _take_lines(self):
        with self._grown:
            while not self._ended:
                try:
                    chunk = os.read(self._output, 1 << 16)
                except BlockingIOError:
                    return
                self._ended = not chunk
                *lines, self._rest = (self._rest + (chunk or b'\n' * bool(self._rest))).split(
                    b'\n'
                )
                lines = [line.decode(errors='replace').rstrip('\r') for line in lines]
                self._lines += lines
                self._up = self._up or any(' ready in ' in line for line in lines)
                self._grown.notify_all()


class Composing:
    """Writes systems into a folder and runs them; `domain_id` is theirs.

    Attributes:
        may_lose_threads: Whether their behaviours end threads of Composer.
    """

    may_lose_threads = False

    def __init__(self, folder, domain_id):
        self.folder = folder
        self.domain_id = domain_id
        self._children = []

    def write(self, text, code='', name='system'):
        """Write `<name>.yaml` and the behaviours `parts`; return the path of the first."""
        (self.folder / 'parts.py').write_text(dedent(code))
        path = self.folder / f'{name}.yaml'
        path.write_text(dedent(text))
        return path

    def run(self, path, *arguments, folder=None):
        """Run `composer up` on a file that is there already."""
        return self.start('up', path, *arguments, folder=folder)

    def start(self, *arguments, folder=None):
        """Run any command."""
        log_folder = self.folder / 'log'
        child = Child(arguments, folder or self.folder, self.domain_id, log_folder)
        self._children.append(child)
        return child

    def __call__(self, text, code='', *arguments):
        """Run `composer up` on a file of this text, with behaviours of the module `parts`."""
        return self.run(self.write(text, code).name, *arguments)

    def end(self):
        for child in self._children:
            child.end()
        # A thread that dies is seen only by what it no longer does.
        dead = [line for child in self._children for line in child.lines if _DEAD.match(line)]
        assert not dead or self.may_lose_threads, f'threads of Composer died: {dead}'


class Peer:
    """A plain rclpy node in a context of its own, spun by a thread.

    rclpy's executors raise where a second thread creates or destroys an action client, or destroys
    a publisher or a subscription, while they spin: that thread does it, see `run`.
    """

    def __init__(self, domain_id):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain_id)
        self.node = rclpy.create_node('peer', context=self.context, use_global_arguments=False)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._spinning = True
        self._thread = ThreadPoolExecutor(1)
        self._end = self._thread.submit(self._spin)
        _peers.append(self)

    def run(self, function, /, *arguments, **keywords):
        """Call a function in the thread that spins, and return what it returns."""
        done = Future()
        task = self._executor.create_task(function, *arguments, **keywords)
        task.add_done_callback(done.set_result)
        wait([done, self._end], DEADLINE_SEC, FIRST_COMPLETED)
        self.check()
        return done.result(0).result()

    def check(self):
        """Raise the error that ended the thread that spins, if one did."""
        if self._end.done():
            self._end.result()

    def known(self):
        """Return what it has discovered: without the nodes, or without their ends."""
        topics = dict(self.node.get_topic_names_and_types())
        ends = {each: len(self.node.get_publishers_info_by_topic(each)) for each in topics}
        return self.node.get_node_names(), ends

    def listen(self, message_class, topic, qos=10):
        """Return a list that grows by each message."""
        heard = []
        self.run(self.node.create_subscription, message_class, topic, heard.append, qos)
        return heard

    def advertise(self, message_class, topic, qos=10):
        """Return a publisher that has met its first subscription."""
        publisher = self.run(self.node.create_publisher, message_class, topic, qos)
        wait_for(publisher.get_subscription_count, f'a subscription to {topic}')
        return publisher

    def call(self, service_class, name, /, **fields):
        """Call a service and return its response."""
        (response,) = self.call_all(service_class, [name], **fields)
        return response

    def call_all(self, service_class, names, /, **fields):
        """Call several services at the same time and return their responses."""
        clients = [self.run(self.node.create_client, service_class, name) for name in names]
        responses = self.call_by(clients, service_class.Request(**fields))
        for client in clients:
            self.run(self.node.destroy_client, client)
        return responses

    def call_by(self, clients, request):
        """Call services by clients that are there, at the same time; return their responses."""
        for client in clients:
            assert client.wait_for_service(DEADLINE_SEC), f'there is no {client.srv_name}'
        calls = [client.call_async(request) for client in clients]
        sent = time.monotonic()

        def all_done():
            nonlocal sent
            # A server that has not found the client's end yet answers into the void, and one that
            # is built anew may not have been found by the client itself.
            if time.monotonic() > sent + PATIENCE_SEC:
                sent = time.monotonic()
                for index, client in enumerate(clients):
                    if not calls[index].done():
                        calls[index] = client.call_async(request)
            return all(call.done() for call in calls)

        wait_for(all_done, f'the responses of {[client.srv_name for client in clients]}')
        return [call.result() for call in calls]

    def change_state(self, node, *transitions):
        """Have a node with a lifecycle make transitions."""
        for transition in transitions:
            assert self.transition(node, transition), f'{node} made no transition {transition}'

    def transition(self, node, transition):
        """Ask a node once for a transition, and return whether it made it.

        To ask twice, as `call` does where an answer is lost, is to be refused. None is lost once
        the node has found the client, as the answer to another one shows that was made later.
        """
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState, GetState

        client = self.run(self.node.create_client, ChangeState, f'{node}/change_state')
        self.call(GetState, f'{node}/get_state')
        request = ChangeState.Request(transition=Transition(id=transition))
        (response,) = self.call_by([client], request)
        self.run(self.node.destroy_client, client)
        return response.success

    def meet_action_server(self, name):
        """Return when the server of an action has found all ends that this peer has by now.

        They are found in the order in which they were made; the last of them is made here.
        """
        from action_msgs.msg import GoalInfo
        from action_msgs.srv import CancelGoal
        from unique_identifier_msgs.msg import UUID

        nobody = GoalInfo(goal_id=UUID(uuid=[1] * 16))
        self.call(CancelGoal, f'{name}/_action/cancel_goal', goal_info=nobody)

    def close(self):
        self._spinning = False
        self._executor.wake()
        self._thread.shutdown()
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()
        self.context.destroy()
        _peers.remove(self)
        self.check()

    def _spin(self):
        while self._spinning:
            self._executor.spin_once(timeout_sec=0.1)
