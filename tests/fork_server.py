"""Starts `python -m composer` by a fork of a process that has imported what each start imports.

Imports are half of the work of a start, and tests start Composer hundreds of times. What is forked
has imported all that a system needs, and has begun nothing: no thread of Python, and no context of
ROS. What reads the variables of ROS is there only for a child with those that the tests have. All
else is as in a new process: the command line, the folder, the environment, the descriptors, the
ignored signals, and how it exits, but for libraries of C that were loaded before.
"""

import ctypes
import gc
import importlib.util
import inspect
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from functools import cache

# What ends a process; a child ignores it if the process that asks does.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
# Variables that Python and libraries read once, when they start.
_READ_ONCE = ('PYTHON', 'LANG', 'LC_', 'LD_', 'OMP_', 'OPENBLAS_', 'NPY_')
# ROS may read one of these when it is imported; the others are read when a context begins.
_OF_ROS = ('ROS', 'RMW_', 'RCUTILS_', 'RCL', 'AMENT_', 'FASTRTPS_', 'FASTDDS_')
_READ_LATER = (
    'RCUTILS_COLORIZED_OUTPUT',
    'RCUTILS_CONSOLE_OUTPUT_FORMAT',
    'ROS_DOMAIN_ID',
    'ROS_HOME',
    'ROS_LOG_DIR',
)
_IMPORTED_OF_ROS = (
    'rclpy.action',
    'rclpy.executors',
    'rclpy.parameter_client',
    'composer.runtime.run',
    'composer.runtime.health.diagnostic_status',
    'lifecycle_msgs.msg',
    'rosidl_generator_py',
    'std_msgs.msg',
    'std_srvs.srv',
)
# What these import in turn is none of ROS.
_IMPORTED = (
    'composer.checks.checker',
    'composer.cli.main',
    'composer.application.reloader',
    'numpy',
)
# The folder of the server stands in its search path for that of a child.
_FOLDER = '/'
_MAX_BYTES = 1 << 17


def start_composer(arguments, folder, environment):
    """Start Composer in a new process, with its output in one pipe."""
    read_once = {name: value for name, value in environment.items() if name.startswith(_READ_ONCE)}
    has_ros = _variables_of_ros(environment) == _variables_of_ros(os.environ)
    server = _server(frozenset(read_once.items()), has_ros)
    return ForkedProcess(server, list(arguments), folder, environment)


def _variables_of_ros(environment):
    return {
        name: value
        for name, value in environment.items()
        if name.startswith(_OF_ROS) and name not in _READ_LATER
    }


@cache
def _server(read_once, has_ros):
    return _Server(dict(read_once), has_ros)


class _Server:
    """The process that forks, which ends with this one."""

    def __init__(self, read_once, has_ros):
        rest = {each: of for each, of in os.environ.items() if not each.startswith(_READ_ONCE)}
        self._socket, its_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its_end:
            self._process = subprocess.Popen(
                [sys.executable, '-m', __name__, str(its_end.fileno()), 'ros' * has_ros],
                cwd=_FOLDER,
                env=rest | read_once,
                # As those of a child, which takes its streams over.
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                pass_fds=[its_end.fileno()],
            )

    def fork(self, request, descriptors):
        """Return the process ID of a new child."""
        socket.send_fds(self._socket, [json.dumps(request).encode()], descriptors)
        answer = self._socket.recv(_MAX_BYTES)
        assert answer, self._process.stdout.read()
        return int(answer)


class ForkedProcess:
    """A child of the server, with what tests use of `subprocess.Popen`."""

    def __init__(self, server, arguments, folder, environment):
        own_end, output = os.pipe()
        self._status, its_end = os.pipe()
        request = {
            'arguments': arguments,
            'folder': str(folder),
            'environment': dict(environment),
            'ignored': [each for each in _SIGNALS if signal.getsignal(each) == signal.SIG_IGN],
        }
        self.pid = server.fork(request, [output, its_end])
        os.close(output)
        os.close(its_end)
        self.stdout = open(own_end, encoding='locale')  # noqa: PTH123, SIM115 - until it has ended
        self.returncode = None

    def poll(self):
        return self._wait(0)

    def wait(self, timeout=None):
        code = self._wait(None if timeout is None else timeout * 1000)
        if code is None:
            command = 'composer'
            raise subprocess.TimeoutExpired(command, timeout)
        return code

    def send_signal(self, number):
        if self.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def _wait(self, timeout_ms):
        """Return what `subprocess.Popen` calls the exit code, or `None` before the end."""
        if self.returncode is None:
            ended = select.poll()
            ended.register(self._status, select.POLLIN)
            if not ended.poll(timeout_ms):
                return None
            self.returncode = int(os.read(self._status, _MAX_BYTES))
            os.close(self._status)
        return self.returncode


def _warm_up():
    """Do once what each start does in the same way."""
    structure = importlib.import_module('composer.schema.structure')
    structure.is_sound({})
    structure.known_keys('')
    # The first line of a log looks for the module of its caller among all modules.
    inspect.getframeinfo(sys._getframe())
    # What children share with this process is no garbage, and they need not look through it.
    gc.freeze()


def _serve(descriptor):
    """Fork a child for each request, and tell how it ended; return the request in the child."""
    requests = socket.socket(fileno=descriptor)
    events = select.poll()
    events.register(requests, select.POLLIN)
    children = {}
    while True:
        for each, _ in events.poll():
            if each in children:
                events.unregister(each)
                _tell_end(each, *children.pop(each))
                continue
            data, descriptors, *_ = socket.recv_fds(requests, _MAX_BYTES, 2)
            if not data:
                sys.exit()  # The tests have ended.
            output, status = descriptors
            pid = os.fork()
            if pid == 0:
                requests.detach()
                return json.loads(data), output
            requests.send(str(pid).encode())
            os.close(output)
            ended = os.pidfd_open(pid)
            children[ended] = pid, status
            events.register(ended, select.POLLIN)


def _tell_end(ended, pid, status):
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    # Whoever asked for the child may be gone.
    with suppress(BrokenPipeError):
        os.write(status, str(code).encode())
    os.close(status)
    os.close(ended)


def _become(request, output):
    """Make this process what it would be if it had been started for the request."""
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.closerange(3, os.sysconf('SC_OPEN_MAX'))
    for number in _SIGNALS:
        usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, signal.SIG_IGN if number in request['ignored'] else usual)
    os.chdir(request['folder'])
    os.environ.clear()
    os.environ.update(request['environment'])
    sys.path[:] = [request['folder'] if each == _FOLDER else each for each in sys.path]
    sys.argv[1:] = request['arguments']
    sys.orig_argv = [sys.executable, '-m', 'composer', *request['arguments']]
    del sys.modules['tests']
    if children := sys.modules.get('composer.runtime.forked_children'):
        # It takes this process for one that a behaviour forked.
        children.in_child = False
    # Libraries of C that were loaded before the fork had threads, which are not here: their
    # destructors would end them. Those that are loaded from now on are destroyed before this.
    libc = ctypes.CDLL(None)
    for function in (libc._exit, libc.fcloseall):
        libc.on_exit(function, None)


if __name__ == '__main__':
    has_ros = bool(sys.argv.pop() and importlib.util.find_spec('rclpy'))
    for name in (*_IMPORTED, *(_IMPORTED_OF_ROS if has_ros else ())):
        importlib.import_module(name)
    _warm_up()
    _become(*_serve(int(sys.argv[1])))
    runpy._run_module_as_main('composer')
