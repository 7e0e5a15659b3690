import fcntl
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from building import SHIPPED, RunPython, StartProgram, WriteDefinitions, process_environment

from composer.interfaces.build.provision import (
    ModuleTakenError,
    make_importable,
    provide_packages,
)
from composer.interfaces.definitions.differences import DefinitionsDifferError
from composer.interfaces.definitions.package_folder import load_definitions

pytestmark = pytest.mark.ros

PROVIDE = """
import sys
from pathlib import Path
from composer.interfaces.build.provision import import_packages, provide_packages
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.packages import load_packages
folders = {name: Path(folder) for name, folder in zip(sys.argv[1::2], sys.argv[2::2])}
definitions = load_packages(folders, InterfaceCatalogue())
provided = provide_packages(definitions, lambda line: print(line, flush=True))
import_packages(provided)
for each in provided:
    print(each.package, each.origin)
"""
StartProvider = Callable[[Path, Path], subprocess.Popen[str]]
EXAMPLE = ('example_interfaces', SHIPPED / 'example_interfaces')
ROBOTS = {'msg/Robot.msg': 'string name\n'}


def silent(_: str) -> None:
    """Take no note of the progress."""


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def start_provider(start_program: StartProgram) -> StartProvider:
    def start(cache: Path, folder: Path) -> subprocess.Popen[str]:
        return start_program('-c', PROVIDE, 'robots', folder, env=process_environment(cache))

    return start


def test_a_cached_start_imports_neither_builder_nor_generators(
    run_python: RunPython,
    shared_cache: Path,
) -> None:
    assert run_python(PROVIDE, *EXAMPLE).returncode == 0
    code = PROVIDE + (
        'print([name for name in sys.modules if name in {"em", "lark", "subprocess", "numpy",'
        ' "rosidl_parser", "rosidl_pycommon", "composer.interfaces.build.builder"}])'
    )
    lines = run_python(code, *EXAMPLE, cache=shared_cache).stdout.splitlines()
    assert lines == ['example_interfaces cached', '[]']


def kill_in_mid_build(start: subprocess.Popen[str], cache: Path, pattern: str) -> bool:
    """Kill a start as soon as a file is there that a pattern in the cache's folder fits.

    Returns whether that was in time: nothing was ready yet.
    """
    interfaces = cache / 'composer' / 'interfaces'
    wait_for(lambda: start.poll() is not None or any(interfaces.glob(pattern)))
    start.kill()
    start.communicate(timeout=60)
    return all(path.suffix for path in interfaces.iterdir())


def test_after_a_killed_build_starts_at_once_build_once_and_later_ones_not_at_all(
    run_python: RunPython,
    start_provider: StartProvider,
    write_definitions: WriteDefinitions,
    tmp_path: Path,
) -> None:
    folder = write_definitions(ROBOTS)
    # A build may be ready before it is seen that it has begun with something.
    cache = next(
        cache
        for cache in (tmp_path / str(attempt) for attempt in range(10))
        if kill_in_mid_build(start_provider(cache, folder), cache, 'robots-*.partial/lib/*.so')
    )
    starts = [start_provider(cache, folder) for _ in range(3)]
    outputs = [start.communicate(timeout=250)[0].splitlines() for start in starts]
    built, *cached = sorted(outputs, key=lambda lines: lines[-1])
    assert built[-3] == 'robots: building 1 interface ...'
    assert built[-2].startswith('robots: built in ')
    assert built[-1] == 'robots built'
    waiting = 'robots: waiting for another start that builds it'
    assert all(lines in (['robots cached'], [waiting, 'robots cached']) for lines in cached)
    code = PROVIDE + 'from robots.msg import Robot; print(Robot(name="Marvin"))'
    later = run_python(code, 'robots', folder, cache=cache, PATH='')
    assert (later.stdout, later.stderr) == (
        "robots cached\nrobots.msg.Robot(name='Marvin')\n",
        '',
    )
    names = [path.suffix for path in (cache / 'composer' / 'interfaces').iterdir()]
    assert sorted(names) == ['', '.lock']


SLOW_COMPILER = """#!/bin/sh
touch {folder}/started
while [ ! -e {folder}/go ]; do sleep 0.02; done
exec g++ "$@"
"""


@pytest.fixture
def slow_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let compilers write `started`, and wait for `go`."""
    compiler = tmp_path / 'slow'
    compiler.write_text(SLOW_COMPILER.format(folder=tmp_path))
    compiler.chmod(0o755)
    monkeypatch.setenv('CXX', str(compiler))


def is_locked(path: Path) -> bool:
    with path.open() as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


@pytest.mark.usefixtures('slow_compiler')
def test_a_killed_build_is_locked_until_its_compilers_are_done(
    start_provider: StartProvider,
    write_definitions: WriteDefinitions,
    tmp_path: Path,
) -> None:
    start = start_provider(tmp_path, write_definitions(ROBOTS))
    assert kill_in_mid_build(start, tmp_path, '../../started')
    [lock] = (tmp_path / 'composer' / 'interfaces').glob('*.lock')
    assert is_locked(lock)
    (tmp_path / 'go').touch()
    wait_for(lambda: not is_locked(lock))


@pytest.mark.usefixtures('slow_compiler')
def test_an_interrupted_build_leaves_nothing(
    start_provider: StartProvider,
    write_definitions: WriteDefinitions,
    tmp_path: Path,
) -> None:
    start = start_provider(tmp_path, write_definitions(ROBOTS))
    wait_for((tmp_path / 'started').exists)
    start.send_signal(signal.SIGINT)
    start.communicate(timeout=60)
    assert start.returncode != 0
    cache = tmp_path / 'composer' / 'interfaces'
    assert [path.suffix for path in cache.iterdir()] == ['.lock']


def test_an_installed_package_is_used(write_definitions: WriteDefinitions) -> None:
    folder = write_definitions({'msg/Empty.msg': '# Nothing.\n'})
    [provided] = provide_packages([load_definitions('std_msgs', folder)], silent)
    assert (provided.package, provided.origin) == ('std_msgs', 'installed')
    assert (provided.prefix / 'share/std_msgs/msg/Empty.json').is_file()


def test_an_installed_package_with_other_definitions_is_an_error(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions({'msg/String.msg': 'wstring data\n'})
    with pytest.raises(DefinitionsDifferError, match=r'-string data\n\+wstring data'):
        provide_packages([load_definitions('std_msgs', folder)], silent)


@pytest.fixture
def own_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'path', list(sys.path))


def write_module(prefix: Path, package: str) -> Path:
    folder = prefix / 'python' / package
    folder.mkdir(parents=True)
    (folder / '__init__.py').write_text(f'place = {str(prefix)!r}')
    return prefix


@pytest.mark.usefixtures('own_path')
def test_a_package_can_be_imported_from_now_on(tmp_path: Path) -> None:
    with pytest.raises(ModuleNotFoundError):
        __import__('imported_robots')
    prefix = write_module(tmp_path, 'imported_robots')
    make_importable('imported_robots', prefix)
    make_importable('imported_robots', prefix)
    assert __import__('imported_robots').place == str(prefix)
    assert sys.path.count(str(prefix / 'python')) == 1


@pytest.mark.usefixtures('own_path')
def test_a_folder_of_definitions_that_was_imported_before_is_forgotten(tmp_path: Path) -> None:
    (tmp_path / 'known_robots' / 'msg').mkdir(parents=True)
    sys.path.insert(0, str(tmp_path))
    __import__('known_robots.msg')
    prefix = write_module(tmp_path / 'built', 'known_robots')
    make_importable('known_robots', prefix)
    assert __import__('known_robots').place == str(prefix)


@pytest.mark.usefixtures('own_path')
def test_a_module_that_has_the_name_is_an_error(tmp_path: Path) -> None:
    prefix = write_module(tmp_path, 'json')
    with pytest.raises(ModuleTakenError) as caught:
        make_importable('json', prefix)
    assert str(caught.value).startswith("the interface package 'json' cannot be imported: ")
    assert str(caught.value).endswith('json/__init__.py has that name')


@pytest.mark.usefixtures('own_path')
def test_a_package_is_not_taken_from_elsewhere(tmp_path: Path) -> None:
    old = write_module(tmp_path / 'old', 'renewed_robots')
    new = write_module(tmp_path / 'new', 'renewed_robots')
    make_importable('renewed_robots', old)
    with pytest.raises(ModuleTakenError):
        make_importable('renewed_robots', new)
