"""Shared memory of killed processes: a start removes segments, and a system locks their ports."""

import fcntl
import os
import re
import signal
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.processes import left_shared_memory

NAME = 'fastrtps_0123456789abcdef'
SYSTEM = 'version: 1\nnodes: {talker: {}}\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder in place of the one of shared memory."""
    monkeypatch.setattr(left_shared_memory, '_FOLDER', tmp_path)
    return tmp_path


def write(folder, name=NAME, lock='_el'):
    """Write a segment and its lock file, and return their paths."""
    paths = [folder / name, folder / f'{name}{lock}']
    for path in paths:
        path.touch()
        os.utime(path, (1, 1))
    return paths


@pytest.mark.parametrize('name', [NAME, 'fastdds_ffffffffffffffff'])
def test_a_segment_that_nobody_locks_is_removed(folder, name):
    write(folder, name)
    left_shared_memory.remove_left_segments()
    assert list(folder.iterdir()) == []


def test_a_lock_file_without_its_segment_is_removed(folder):
    write(folder)[0].unlink()
    left_shared_memory.remove_left_segments()
    assert list(folder.iterdir()) == []


def is_kept(paths):
    left_shared_memory.remove_left_segments()
    return all(path.exists() for path in paths)


def test_a_segment_in_use_is_kept(folder):
    segment, lock = write(folder)
    with lock.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert is_kept([segment, lock])
    assert not is_kept([segment, lock])


def test_a_segment_that_is_being_created_is_kept(folder):
    segment, lock = write(folder)
    os.utime(lock)
    assert is_kept([segment, lock])


@pytest.mark.parametrize(
    ('name', 'lock'),
    [('fastrtps_port7411', '_el'), ('fastrtps_0123', '_el'), (NAME, '_elx'), ('others', '_el')],
)
def test_other_files_are_kept(folder, name, lock):
    assert is_kept(write(folder, name, lock))


@pytest.mark.parametrize('which', [0, 1])
def test_what_belongs_to_another_user_is_kept(folder, monkeypatch, which):
    paths = write(folder)
    if os.geteuid() == 0:
        os.chown(paths[which], 12345, -1)
    else:
        monkeypatch.setattr(os, 'geteuid', lambda: os.getuid() + 1)
    assert is_kept(paths)


def test_a_link_is_kept(folder):
    segment, lock = write(folder)
    lock.rename(folder / 'elsewhere')
    lock.symlink_to('elsewhere')
    assert is_kept([segment, lock])


def test_a_folder_that_is_not_there_is_no_error(folder, monkeypatch):
    monkeypatch.setattr(left_shared_memory, '_FOLDER', folder / 'nowhere')
    left_shared_memory.remove_left_segments()


PORT_LOCK = 'fastrtps_port7411_el'


@pytest.fixture
def left_ports():
    """Return the ports that a system keeps locked."""
    ports = left_shared_memory.LeftPorts()
    yield ports
    ports.close()


def touch_port(lock):
    """Write a port and its lock file."""
    lock.touch()
    lock.with_name(lock.name.removesuffix('_el')).touch()


def is_locked(path):
    with path.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def test_the_ports_of_killed_processes_are_locked_until_the_end(folder, left_ports):
    paths = [folder / PORT_LOCK, folder / 'fastdds_port7413_el']
    for path in paths:
        touch_port(path)
        left_ports.lock()
    assert all(map(is_locked, paths))
    left_ports.close()
    assert not any(map(is_locked, paths))


@pytest.mark.parametrize('name', ['fastrtps_port7411', 'fastrtps_port7411_sl', f'{NAME}_el'])
def test_no_other_files_are_locked(folder, left_ports, name):
    touch_port(folder / name)
    left_ports.lock()
    assert not is_locked(folder / name)


def test_the_lock_of_a_port_that_was_removed_is_given_up(folder, left_ports):
    path = folder / PORT_LOCK
    touch_port(path)
    left_ports.lock()
    path.with_name('fastrtps_port7411').unlink()
    left_ports.lock()
    assert not is_locked(path)


def test_ports_that_were_left_before_the_system_are_used_again(folder, left_ports):
    path = folder / PORT_LOCK
    touch_port(path)
    os.utime(path, (1, 1))
    left_ports.lock()
    assert not is_locked(path)


def test_the_port_of_a_living_process_is_left_to_it(folder, left_ports):
    path = folder / PORT_LOCK
    touch_port(path)
    with path.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        left_ports.lock()
    assert not is_locked(path)


def locks_of(child):
    """Return the lock files of the segments of a process."""
    files = []
    for path in Path(f'/proc/{child.pid}/fd').iterdir():
        # It may be closed between two looks.
        with suppress(FileNotFoundError):
            files.append(path.readlink())
    return [path for path in files if re.fullmatch('fast(rtps|dds)_[0-9a-f]{16}_el', path.name)]


@pytest.mark.ros
def test_a_start_removes_what_a_killed_system_left(compose):
    children = [compose.run(compose.write(SYSTEM, name=name)) for name in ('killed', 'living')]
    killed, living = children
    for child in children:
        child.wait_until_ready()
    [left], [kept] = locks_of(killed), locks_of(living)
    killed.send(signal.SIGKILL)
    killed.wait()
    for path in (left, kept):
        os.utime(path, (1, 1))

    third = compose(SYSTEM)
    third.wait_until_ready()

    for path, exists in ((left, False), (kept, True)):
        assert [path.exists(), path.with_name(path.name[:-3]).exists()] == [exists, exists]
    assert third.stop() == 0
    assert living.stop() == 0
    assert not kept.exists()
