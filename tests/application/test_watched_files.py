"""Edits of files on disk, by whatever means: each is seen, and seen when it is written."""

import os
import shutil
import threading
import time

import pytest

from composer.application.watched_files import WatchedFiles

DEADLINE_SEC = 20.0
NEW = 'first line\nsecond line\n'


class Watcher:
    """Reads a file after each edit that is seen.

    Attributes:
        read: What was in it then; `None` if it was not there.
        told: What was logged.
    """

    def __init__(self, path):
        self._path = path
        self.read, self.told = [], []
        self._files = WatchedFiles([path])
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._follow)
        self._thread.start()

    def _follow(self):
        for _ in self._files.edits(self._ended, self.told.append):
            self._files.note_reading()
            try:
                self.read.append(self._path.read_text())
            except OSError:
                self.read.append(None)

    def wait_for(self, text):
        until = time.monotonic() + DEADLINE_SEC
        while text not in self.read[-1:]:
            assert time.monotonic() < until, f'saw {self.read}, told {self.told}'
            time.sleep(0.01)

    def end(self):
        self._ended.set()
        self._thread.join()


@pytest.fixture
def watch():
    watchers = []

    def create(path):
        watchers.append(Watcher(path))
        return watchers[-1]

    yield create
    for each in watchers:
        each.end()


def write(path, text):
    path.write_text(text)


def write_beside(path, text):
    path.with_name('4913').write_text(text)
    path.with_name('4913').replace(path)


def write_anew(path, text):
    path.unlink()
    time.sleep(0.05)
    path.write_text(text)


def write_after_backup(path, text):
    path.rename(path.with_name('robot.yaml~'))
    path.write_text(text)


def write_with_old_time(path, text):
    status = path.stat()
    path.write_text(text)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def write_through_link(path, text):
    other = path.parent / 'elsewhere' / 'other.yaml'
    other.parent.mkdir(exist_ok=True)
    other.write_text('not yet')
    turn(path, other)
    time.sleep(0.05)
    other.write_text(text)


def write_folder_anew(path, text):
    aside = path.parent.with_name('aside')
    shutil.copytree(path.parent, aside, symlinks=True)
    shutil.rmtree(path.parent)
    time.sleep(0.05)
    aside.rename(path.parent)
    path.write_text(text)


def turn(link, target):
    """Let a link lead elsewhere, at once."""
    beside = link.with_name('..beside')
    beside.symlink_to(target)
    beside.replace(link)


@pytest.mark.parametrize(
    'edit',
    [
        write,
        write_beside,
        write_anew,
        write_after_backup,
        write_with_old_time,
        write_through_link,
        write_folder_anew,
    ],
)
def test_an_edit_is_seen_however_it_is_made(tmp_path, watch, edit):
    path = tmp_path / 'project' / 'robot.yaml'
    path.parent.mkdir()
    path.write_text('old')
    watcher = watch(path)
    # The second one is of what the first has made.
    for text in ('new', 'newer'):
        edit(path, text)
        watcher.wait_for(text)
    assert watcher.told == []


def test_folders_that_are_swapped_are_seen(tmp_path, watch):
    """As Kubernetes does with the files of a ConfigMap, and others with releases."""
    for number in range(3):
        (tmp_path / f'..{number}').mkdir()
        (tmp_path / f'..{number}' / 'robot.yaml').write_text(f'{number}')
    (tmp_path / '..data').symlink_to('..0')
    (tmp_path / 'robot.yaml').symlink_to('..data/robot.yaml')
    watcher = watch(tmp_path / 'robot.yaml')
    for number in (1, 2):
        turn(tmp_path / '..data', f'..{number}')
        shutil.rmtree(tmp_path / f'..{number - 1}')
        watcher.wait_for(f'{number}')


def test_what_is_not_there_yet_is_seen_when_it_comes(tmp_path, watch):
    path = tmp_path / 'parts' / 'inner' / 'robot.yaml'
    watcher = watch(path)
    path.parent.mkdir(parents=True)
    path.write_text('new')
    watcher.wait_for('new')


@pytest.mark.parametrize('pause_sec', [0.001, 0.05, 0.4])
def test_a_file_that_is_being_written_is_not_read(tmp_path, watch, pause_sec):
    path = tmp_path / 'robot.yaml'
    path.write_text('old')
    watcher = watch(path)
    with path.open('w', buffering=1) as file:
        for line in NEW.splitlines(keepends=True):
            file.write(line)
            time.sleep(pause_sec)
    watcher.wait_for(NEW)
    assert watcher.read == [NEW]


def test_edits_since_the_reading_began_are_seen(tmp_path, watch):
    path = tmp_path / 'robot.yaml'
    begun_ns = time.time_ns()
    path.write_text('old')
    assert WatchedFiles([path], begun_ns).list_changed() == [path]
    os.utime(path, (1, 1))
    assert WatchedFiles([path], time.time_ns() + 10**9).list_changed() == []


def test_without_the_kernel_files_are_looked_at(tmp_path, watch, monkeypatch):
    def refuse(*_args, **_kwargs):
        message = f'OS file watch limit reached. about ["{tmp_path}"] (Error)'
        raise OSError(message)

    monkeypatch.setattr('watchfiles.watch', refuse)
    path = tmp_path / 'robot.yaml'
    path.write_text('old')
    watcher = watch(path)
    for text in ('new', 'newer'):
        path.write_text(text)
        watcher.wait_for(text)
    assert watcher.told == ['files are looked at twice a second: OS file watch limit reached']
