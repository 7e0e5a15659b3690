import errno
import fcntl
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from building import WriteDefinitions

from composer.ament import BUILD_MANIFEST, ament_prefixes
from composer.interfaces.build import build_cache
from composer.interfaces.build.build_cache import (
    BuildFolder,
    CacheError,
    compute_environment_key,
    compute_key,
    list_built,
    provide_cached,
)
from composer.interfaces.build.manifest import write_manifest
from composer.interfaces.definitions.package_folder import PackageDefinitions, load_definitions


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'home'))
    return build_cache.find_cache()


def build(folder: BuildFolder) -> None:
    (folder.path / 'file').write_text('built')


def refuse(_: BuildFolder) -> None:
    pytest.fail('built again')


def no_news(line: str) -> None:
    pytest.fail(line)


def provide(
    name: str,
    build: Callable[[BuildFolder], None],
    progress: Callable[[str], None] = no_news,
) -> Path:
    return provide_cached(name, 'key', build, progress)


def test_a_relative_cache_home_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('XDG_CACHE_HOME', 'relative')
    assert build_cache.find_cache() == Path.home() / '.cache/composer/interfaces'


def test_a_package_is_built_once(home: Path) -> None:
    place = provide('one', build)
    assert place == home / 'one'
    assert provide('one', refuse) == place
    assert (place / 'file').read_text() == 'built'
    assert sorted(path.name for path in home.iterdir()) == ['one', 'one.lock']


def test_a_failed_build_leaves_nothing(home: Path) -> None:
    def fail(folder: BuildFolder) -> None:
        build(folder)
        raise KeyError

    with pytest.raises(KeyError):
        provide('one', fail)
    assert [path.name for path in home.iterdir()] == ['one.lock']
    provide('one', build)


def test_what_a_killed_build_left_is_removed(home: Path) -> None:
    for name in ('one', 'other', 'living'):
        (home / f'{name}.partial').mkdir(parents=True)
        (home / f'{name}.partial' / 'half').touch()
    with (home / 'living.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        place = provide('one', build)
    assert sorted(path.name for path in place.iterdir()) == [BUILD_MANIFEST, 'file']
    assert [path.name for path in home.glob('*.partial')] == ['living.partial']


def test_who_waits_for_a_build_uses_it(home: Path) -> None:
    home.mkdir(parents=True)
    lock = os.open(home / 'one.lock', os.O_RDWR | os.O_CREAT)
    fcntl.flock(lock, fcntl.LOCK_EX)

    def finish_the_other_build(line: str) -> None:
        assert line == 'waiting for another start that builds it'
        place = home / 'one'
        place.mkdir()
        write_manifest(place, place, 'key')
        os.close(lock)

    assert provide('one', refuse, finish_the_other_build) == home / 'one'


def test_a_lock_is_held_as_long_as_a_program_of_the_build_has_it(home: Path) -> None:
    kept = -1

    def keep(folder: BuildFolder) -> None:
        nonlocal kept
        kept = os.dup(folder.descriptor)
        raise KeyError

    with pytest.raises(KeyError):
        provide('one', keep)
    lines = []

    def end_the_program(line: str) -> None:
        lines.append(line)
        os.close(kept)

    assert provide('one', build, end_the_program) == home / 'one'
    assert lines == ['waiting for another start that builds it']


def test_a_cache_that_cannot_be_written_is_an_error(home: Path) -> None:
    home.parent.parent.mkdir(parents=True)
    home.parent.write_text('in the way')
    with pytest.raises(CacheError) as caught:
        provide('one', build)
    assert str(caught.value).startswith('the cache of built interface packages cannot be written')
    assert caught.value.help == 'make room there, or name another folder in XDG_CACHE_HOME'


def test_a_cache_that_search_paths_cannot_name_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('XDG_CACHE_HOME', f'{tmp_path}/a:b')
    with pytest.raises(CacheError) as caught:
        provide('one', refuse)
    assert caught.value.help == "name a folder without ':' in XDG_CACHE_HOME"
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_called_that(home: Path) -> None:
    def fail(_: BuildFolder) -> None:
        raise OSError(errno.ENOSPC, 'No space left on device')

    with pytest.raises(CacheError) as caught:
        provide('one', fail)
    assert str(caught.value) == f"there is no space left for built interface packages in '{home}'"
    assert caught.value.help == 'make room there, or name another folder in XDG_CACHE_HOME'


@pytest.mark.parametrize('damage', ['empty folder', 'cut off'])
def test_a_damaged_build_is_built_again(home: Path, damage: str) -> None:
    place = provide('one', build)
    if damage == 'cut off':
        os.truncate(place / 'file', 3)
    else:
        shutil.rmtree(place)
        place.mkdir()
    lines: list[str] = []
    assert provide('one', build, lines.append) == place
    assert lines == ['the build in the cache is damaged']
    assert provide('one', refuse) == place
    assert (place / 'file').read_text() == 'built'
    assert sorted(path.name for path in home.iterdir()) == ['one', 'one.lock']


def test_of_several_builds_the_last_used_is_listed(home: Path) -> None:
    environment = compute_environment_key([])

    def use(name: str, environment: str = environment) -> Path:
        return provide_cached(name, environment, build, no_news)

    place = use('robots-1')
    assert list_built([]) == {'robots': place}
    manifest = home / 'ros/share/rclpy/package.xml'
    manifest.parent.mkdir(parents=True)
    manifest.write_text('<version>99.0.0</version>')
    assert list_built([home / 'workspace']) == {'robots': place}
    assert list_built([home / 'ros']) == {}
    later = use('robots-2')
    use('robots-3', 'another ROS')
    os.truncate(use('others-1') / 'file', 0)
    os.utime(later / BUILD_MANIFEST, (1, 1))
    assert list_built([]) == {'robots': place}
    use('robots-2')
    assert list_built([]) == {'robots': later}


@pytest.fixture
def definitions(write_definitions: WriteDefinitions) -> PackageDefinitions:
    return load_definitions('robots', write_definitions({'msg/A.msg': 'std_msgs/Header a\n'}))


@pytest.mark.ros
def test_equal_definitions_have_equal_keys_wherever_they_are(
    definitions: PackageDefinitions,
    tmp_path: Path,
) -> None:
    moved = replace(definitions, folder=tmp_path)
    prefixes = ament_prefixes()
    assert compute_key(moved, prefixes, {}) == compute_key(definitions, prefixes, {})


@pytest.mark.ros
@pytest.mark.parametrize(
    'changes',
    [
        {'package': 'others'},
        {'sources': {'msg/A.msg': 'std_msgs/Header b\n'}},
        {'sources': {'msg/B.msg': 'std_msgs/Header a\n'}},
    ],
)
def test_other_definitions_have_another_key(
    definitions: PackageDefinitions,
    changes: Mapping[str, object],
) -> None:
    prefixes = ament_prefixes()
    changed = replace(definitions, **changes)  # type: ignore[arg-type]
    assert compute_key(changed, prefixes, {}) != compute_key(definitions, prefixes, {})


@pytest.mark.ros
@pytest.mark.parametrize('package', ['rclpy', 'rosidl_generator_c', 'std_msgs'])
def test_another_release_of_ros_or_of_a_used_package_makes_another_key(
    definitions: PackageDefinitions,
    tmp_path: Path,
    package: str,
) -> None:
    prefixes = [tmp_path, *ament_prefixes()]
    before = compute_key(definitions, prefixes, {})
    # A workspace that has nothing to do with it changes nothing.
    unrelated = tmp_path / 'other' / 'share' / 'unrelated' / 'package.xml'
    unrelated.parent.mkdir(parents=True)
    unrelated.write_text('<version>1.0.0</version>')
    assert compute_key(definitions, [tmp_path / 'other', *prefixes], {}) == before
    assert compute_key(definitions, prefixes[1:], {}) == before
    manifest = tmp_path / 'share' / package / 'package.xml'
    manifest.parent.mkdir(parents=True)
    manifest.write_text('<version>99.0.0</version>')
    assert compute_key(definitions, prefixes, {}) != before


@pytest.mark.ros
def test_python_numpy_builder_and_used_builds_make_another_key(
    definitions: PackageDefinitions,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    prefixes = ament_prefixes()
    keys = {compute_key(definitions, prefixes, {}), compute_key(definitions, prefixes, {'a': '1'})}
    for name, value in (
        ('BUILDER_FORMAT', 99),
        ('EXTENSION_SUFFIXES', ['.other.so']),
        ('_numpy_version', lambda: '99'),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(build_cache, name, value)
            keys.add(compute_key(definitions, prefixes, {}))
    assert len(keys) == 5
    assert compute_environment_key(prefixes) != compute_environment_key([])
