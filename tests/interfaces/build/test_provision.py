import fcntl
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from building import RunPython, StartProgram, WriteDefinitions, process_environment

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
definitions = load_packages(folders, InterfaceCatalogue(), {'robots': ['msg/Robot']})
provided = provide_packages(definitions, lambda line: print(line, flush=True))
import_packages(provided)
for each in provided:
    print(each.package, each.origin)
"""
StartProvider = Callable[[Path, Path], subprocess.Popen[str]]
ROBOTS = {'msg/Robot.msg': 'string name\n', 'msg/Unused.msg': 'Robot robot\n'}


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
def test_interrupted_and_killed_builds_leave_nothing_and_of_those_at_once_one_builds(
    run_python: RunPython,
    start_provider: StartProvider,
    write_definitions: WriteDefinitions,
    tmp_path: Path,
) -> None:
    folder = write_definitions(ROBOTS)
    cache = tmp_path / 'composer' / 'interfaces'

    def end_in_mid_build(number: int) -> int:
        (tmp_path / 'started').unlink(missing_ok=True)
        start = start_provider(tmp_path, folder)
        wait_for((tmp_path / 'started').exists)
        start.send_signal(number)
        start.communicate(timeout=60)
        return start.returncode

    assert end_in_mid_build(signal.SIGINT) != 0
    [lock] = cache.iterdir()
    assert lock.suffix == '.lock'
    assert end_in_mid_build(signal.SIGKILL) == -signal.SIGKILL
    # Until its compilers are done.
    assert is_locked(lock)
    starts = [start_provider(tmp_path, folder) for _ in range(2)]
    (tmp_path / 'go').touch()
    outputs = [start.communicate(timeout=250)[0].splitlines() for start in starts]
    built, cached = sorted(outputs, key=lambda lines: lines[-1])
    waiting = 'robots: waiting for another start that builds it'
    assert built[-3] == 'robots: building 1 interface of 2 ...'
    assert built[-2].startswith('robots: built in ')
    assert built[-1] == 'robots built'
    assert cached in (['robots cached'], [waiting, 'robots cached'])
    assert not is_locked(lock)
    # One that finds it built imports nothing that a build needs.
    code = PROVIDE + (
        'print([name for name in sys.modules if name in {"em", "lark", "subprocess", "numpy",'
        ' "rosidl_parser", "rosidl_pycommon", "composer.interfaces.build.builder"}])\n'
        'from robots.msg import Robot; print(Robot(name="Marvin"))'
    )
    later = run_python(code, 'robots', folder, cache=tmp_path, PATH='')
    assert (later.stdout, later.stderr) == (
        "robots cached\n[]\nrobots.msg.Robot(name='Marvin')\n",
        '',
    )
    assert sorted(path.suffix for path in cache.iterdir()) == ['', '.lock']
    modules = cache.glob('robots-*/python/robots/msg/_*.py')
    assert {path.name for path in modules} == {'__init__.py', '_robot.py'}


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
