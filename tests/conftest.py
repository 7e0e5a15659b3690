"""What tests of running systems share, as fixtures."""

import os
import resource
import shutil
import signal
import subprocess
import sys
from collections import Counter
from contextlib import ExitStack

import pytest
from hypothesis import HealthCheck, settings

from composer.processes.guardian import RLIMIT_LOCKS
from tests.plugin import PLUGINS
from tests.recorded import filled
from tests.running import DEADLINE_SEC, ROOT, Composing, Peer, reserved_domain, wait_for
from tests.terminal_screen import Terminal

# The scenarios of the shipped systems are tests, too; `pytester` runs pytest within tests.
pytest_plugins = ('pytester', *PLUGINS)

# Ports of shared memory have numbers that all domains of a computer share, and of processes that
# start or end at the same moment, one may remove the port of another: Fast DDS gives its semaphore a
# new file while others wait at the old one. Who lost it never hears of any node. The kernel gives a
# port of UDP to one process alone.
os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')

# What hypothesis tries is the same in each run, and no test fails for the time that it takes.
settings.register_profile(
    'steady',
    database=None,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile('steady')

# A shell lets its jobs in the background ignore SIGINT, and `nohup` SIGHUP; children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_collection_modifyitems(items):
    rows = Counter()
    for item in items:
        if item.get_closest_marker('sampled'):
            function = item.nodeid.partition('[')[0]
            rows[function] += 1
            if rows[function] % 3:
                item.add_marker('long')
        if item.get_closest_marker('long') and not os.environ.get('LONG'):
            item.add_marker(pytest.mark.skip(reason='takes long: LONG=1 runs it'))


@pytest.fixture(autouse=True)
def process_of_no_system():
    """Fail a test that runs, in this process, a system that ends the process seconds later."""
    before = resource.getrlimit(RLIMIT_LOCKS)
    yield
    assert resource.getrlimit(RLIMIT_LOCKS) == before, (
        'the guardian of a system has marked this process'
    )


@pytest.fixture(name='wait_for')
def wait_for_fixture():
    return wait_for


@pytest.fixture
def domain_id(monkeypatch):
    """Return a ROS domain of the test's own, which holds for its child processes too."""
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


@pytest.fixture
def shared_memory(monkeypatch):
    """Let the processes of a test use shared memory, as Fast DDS does by itself."""
    monkeypatch.delenv('FASTDDS_BUILTIN_TRANSPORTS')


@pytest.fixture
def other_domain_id():
    """Return a second ROS domain of the test's own."""
    with reserved_domain() as domain:
        yield domain


@pytest.fixture
def terminal(tmp_path):
    """Return a terminal, with what types keys and reads the screen."""
    if shutil.which('tmux') is None:
        pytest.skip('tmux is not installed')
    terminal = Terminal(tmp_path / 'tmux')
    yield terminal
    terminal.end()


@pytest.fixture(scope='session')
def shared_cache(tmp_path_factory):
    """Return a cache folder of the whole test run: each package is built once in it."""
    folder = tmp_path_factory.getbasetemp()
    if 'PYTEST_XDIST_WORKER' in os.environ:
        folder = folder.parent
    folder /= 'shared_cache'
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope='session')
def built_interfaces(shared_cache):
    """Return a cache folder that has the packages of the shipped systems."""
    files = [f'configs/{name}.yaml' for name in ('self_contained', 'fibonacci_client', 'cell')]
    subprocess.run(
        [sys.executable, '-m', 'composer', 'interfaces', 'build', *files],
        cwd=ROOT,
        env=os.environ | {'XDG_CACHE_HOME': str(shared_cache)},
        check=True,
    )
    return shared_cache


@pytest.fixture
def interface_cache(built_interfaces, monkeypatch):
    """Let child processes find the packages of the shipped systems built."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(built_interfaces))
    return built_interfaces


@pytest.fixture
def compose(tmp_path, domain_id):
    """Run systems in child processes, which are gone when the test ends."""
    composing = Composing(tmp_path, domain_id)
    yield composing
    composing.end()


@pytest.fixture
def start_program():
    """Run Python programs, such as plain rclpy peers; they are gone when the test ends.

    A signal that can be heard would not do: rclpy loses one now and then.
    """
    with ExitStack() as programs:

        def start(*arguments, **options):
            process = subprocess.Popen(
                [sys.executable, *map(str, arguments)],
                **{'stdout': subprocess.PIPE, 'text': True} | options,
            )
            programs.enter_context(process)
            programs.callback(process.kill)
            return process

        yield start


@pytest.fixture
def peer(domain_id):
    """Return a plain rclpy node in the test's domain."""
    peer = Peer(domain_id)
    yield peer
    peer.close()


@pytest.fixture
def context(domain_id):
    """Return a context of rclpy in the test's domain."""
    import rclpy

    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain_id)
    yield context
    context.try_shutdown()


@pytest.fixture
def executor(context):
    """Return an executor that does what rclpy's do."""
    from composer.executor import ComposerExecutor

    executor = ComposerExecutor(context=context)
    yield executor
    executor.shutdown(DEADLINE_SEC)


@pytest.fixture
def node(context, executor):
    """Return a node in the executor."""
    import rclpy

    node = rclpy.create_node('node', context=context)
    executor.add_node(node)
    yield node
    node.destroy_node()


@pytest.fixture(scope='module')
def shared_compose(tmp_path_factory):
    """Run systems that all tests of a module look at."""
    with reserved_domain() as domain:
        composing = Composing(tmp_path_factory.mktemp('shared'), domain)
        yield composing
        composing.end()


@pytest.fixture(scope='module')
def shared_peer(shared_compose):
    """Return a plain rclpy node in the domain of `shared_compose`."""
    peer = Peer(shared_compose.domain_id)
    yield peer
    peer.close()


@pytest.fixture(scope='module')
def graph(request, shared_compose, shared_peer):
    """Return a plain node in the domain where the module's `SYSTEM` runs with its `CODE`."""
    shared_compose(request.module.SYSTEM, request.module.CODE).wait_until_ready()
    return shared_peer.node


@pytest.fixture
def all_messages():
    """Return filled messages of each type of test_msgs and of some nested deeply, by topic."""
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.interfaces.classes import import_interface

    catalogue = InterfaceCatalogue()
    names = [*catalogue.names('msg', 'test_msgs'), 'nav_msgs/msg/Odometry', 'std_msgs/msg/Char']
    return {
        f'/{name.replace("/", "_").lower()}': [filled(import_interface(name)) for _ in range(3)]
        for name in names
    }
