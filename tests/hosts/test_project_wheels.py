"""The wheel of Composer: the same files are the same bytes, and pip takes it."""

import subprocess
import sys

import pytest

from composer.hosts.wheels import read_folder, write_composer_wheel


def test_what_tools_leave_does_not_count(tmp_path):
    for name in (
        'a.py',
        'data/model.onnx',
        '__pycache__/a.cpython-311.pyc',
        '.mypy_cache/a',
        'b.pyc',
    ):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b'1')
    assert [name for name, _ in read_folder(tmp_path)] == ['a.py', 'data/model.onnx']


@pytest.mark.long
def test_pip_installs_the_wheel_of_composer_and_it_runs(tmp_path):
    path = write_composer_wheel(tmp_path)
    data = path.read_bytes()
    assert write_composer_wheel(tmp_path) == path
    assert path.read_bytes() == data
    target = tmp_path / 'there'
    pip = [sys.executable, '-m', 'pip', 'install', '-q', '--no-deps', '--no-index', '--target']
    subprocess.run([*pip, str(target), str(path)], check=True)
    (tmp_path / 'robot.yaml').write_text('version: 1\nnodes: {talker: {}}\n')
    code = f'import sys; sys.path.insert(0, {str(target)!r}); from composer.__main__ import main; main()'
    words = [sys.executable, '-c', code, 'check', '-q', 'robot.yaml']
    done = subprocess.run(words, cwd=tmp_path, env={}, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, '')
