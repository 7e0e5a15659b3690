"""Wheels of a project: the same files are the same bytes, and pip takes them."""

import io
import subprocess
import sys
import zipfile

from hypothesis import given
from hypothesis import strategies as st

from composer.hosts.wheels import build_composer_wheel, build_wheel, read_folder

FILES = st.dictionaries(
    st.from_regex(r'[a-z]{1,5}(/[a-z]{1,5})?\.py', fullmatch=True), st.binary(max_size=40)
)


@given(FILES)
def test_the_order_of_files_does_not_matter(files):
    there = build_wheel('project', files)
    back = build_wheel('project', dict(reversed(files.items())))
    assert there == back
    with zipfile.ZipFile(io.BytesIO(there.data)) as archive:
        assert {name: archive.read(name) for name in files} == files


@given(FILES, FILES)
def test_other_files_are_another_version(files, others):
    names = {build_wheel('project', each).name for each in (files, others)}
    assert (len(names) == 1) == (files == others)


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


def test_pip_installs_the_wheel_of_composer_and_it_runs(tmp_path):
    wheel = build_composer_wheel()
    assert wheel == build_composer_wheel()
    path = tmp_path / wheel.name
    path.write_bytes(wheel.data)
    target = tmp_path / 'there'
    pip = [sys.executable, '-m', 'pip', 'install', '-q', '--no-deps', '--no-index', '--target']
    subprocess.run([*pip, str(target), str(path)], check=True)
    (tmp_path / 'robot.yaml').write_text('version: 1\nnodes: {talker: {}}\n')
    code = f'import sys; sys.path.insert(0, {str(target)!r}); from composer.__main__ import main; main()'
    words = [sys.executable, '-c', code, 'check', '-q', 'robot.yaml']
    done = subprocess.run(words, cwd=tmp_path, env={}, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, '')
