"""The folder of external processes goes with the system, also if all its processes are killed."""

import os
import subprocess
import sys

import pytest

from composer.processes.process_folder import ProcessFolder

_HOLDS_ONE = """
import sys
from composer.processes.process_folder import ProcessFolder

folder = ProcessFolder()
(folder.path / 'parameters.yaml').touch()
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    return tmp_path


def test_a_folder_whose_process_was_killed_is_removed_by_the_next_start(scratch):
    others = scratch / 'composer-processes-file', scratch / 'composer-of-others'
    others[0].touch()
    others[1].mkdir()
    with subprocess.Popen(
        [sys.executable, '-c', _HOLDS_ONE],
        env=os.environ | {'TMPDIR': str(scratch)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        held = scratch / process.stdout.readline().strip()
        for each in (held, *others):
            os.utime(each, (0, 0))
        ProcessFolder().remove()
        assert {*scratch.iterdir()} == {held, *others}

        process.kill()
        process.wait()
        ProcessFolder().remove()
    assert {*scratch.iterdir()} == {*others}


def test_a_folder_that_may_not_be_locked_yet_stays(scratch):
    young = scratch / 'composer-processes-young'
    young.mkdir()
    folder = ProcessFolder()
    assert {*scratch.iterdir()} == {young, folder.path}
    folder.remove()
    assert {*scratch.iterdir()} == {young}
