"""A start removes the shared memory that killed processes of this user left, and nothing else."""

import fcntl
import os
import re
import signal
import struct
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.runtime.middleware import shared_memory

NAME = 'fastrtps_0123456789abcdef'
SYSTEM = 'version: 1\nnodes: {talker: {}}\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder in place of the one of shared memory."""
    monkeypatch.setattr(shared_memory, '_FOLDER', tmp_path)
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
    shared_memory.remove_left_segments()
    assert list(folder.iterdir()) == []


def test_a_lock_file_without_its_segment_is_removed(folder):
    write(folder)[0].unlink()
    shared_memory.remove_left_segments()
    assert list(folder.iterdir()) == []


def is_kept(paths):
    shared_memory.remove_left_segments()
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
    [('fastrtps_port7411', '_el'), (NAME, '_elx')],
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


PORT, NODE_OFFSET, FLAGS_OFFSET = 7411, 256, 300
OK_AND_OPENED = 7


def write_port(path):
    """Write a port of shared memory: in its node, its number, two times and the flags count."""
    node = struct.pack('<qIII5III', 5, 2, 600, 700, PORT, 1, 1000, 333, 512, 1, OK_AND_OPENED)
    path.write_bytes(b'\1' * NODE_OFFSET + node + b'\2' * 2000)
    return path.read_bytes()


def replace_port(folder):
    """Return what others have mapped before and after a port is replaced by that of a new process."""
    path = folder / f'fastrtps_port{PORT}'
    before = write_port(path)
    with path.open('rb') as mapped:
        with shared_memory.replacing_ports(0):
            path.unlink()
            content = write_port(path)
        assert path.read_bytes() == content
        return before, mapped.read()


def test_a_port_that_is_replaced_is_marked_as_unusable(folder):
    before, after = replace_port(folder)
    assert [at for at in range(len(before)) if before[at] != after[at]] == [FLAGS_OFFSET]
    assert (before[FLAGS_OFFSET], after[FLAGS_OFFSET]) == (OK_AND_OPENED, OK_AND_OPENED - 1)


def test_a_port_that_is_not_replaced_stays(folder):
    path = folder / f'fastrtps_port{PORT}'
    before = write_port(path)
    with shared_memory.replacing_ports(0):
        pass
    assert path.read_bytes() == before


def test_a_port_of_another_user_stays(folder, monkeypatch):
    monkeypatch.setattr(os, 'geteuid', lambda: os.getuid() + 1)
    before, after = replace_port(folder)
    assert before == after


def locks_of(child):
    """Return the lock files of the segments of a process."""
    files = []
    for path in Path(f'/proc/{child.pid}/fd').iterdir():
        # It may be closed between two looks.
        with suppress(FileNotFoundError):
            files.append(path.readlink())
    return [path for path in files if re.fullmatch('fast(rtps|dds)_[0-9a-f]{16}_el', path.name)]


@pytest.mark.usefixtures('shared_memory')
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
