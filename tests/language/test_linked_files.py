"""Relative paths in a file that is reached through a symbolic link lie beside the file itself."""

from pathlib import Path

import pytest

from composer import api
from composer.cli import main as cli

ROBOT = """\
version: 1
interfaces: {shapes: ../shapes}
include: {arm: {file: INCLUDED}}
nodes:
  robot:
    parameters: {rate: 1}
    parameter_files: [robot.params.yaml]
    timers: {tick: {period: 1, behaviour: drive:tick}}
processes:
  camera: {command: [ls, "{{ here }}"], cwd: camera}
"""
ARM = """\
version: 1
include: {hand: {file: ../parts/hand.yaml}}
nodes:
  arm:
    parameters: {rate: 1}
    parameter_files: [arm.params.yaml]
    timers: {tick: {period: 1, behaviour: drive_arm:tick}}
"""
TICK = 'def tick(node):\n    print(node.parameters.rate)\n'
FILES = {
    'shapes/msg/Point.msg': 'float64 x\n',
    'configs/robot.yaml': ROBOT,
    'configs/robot.params.yaml': 'robot: {ros__parameters: {rate: 2}}\n',
    'configs/drive.py': TICK,
    'configs/camera/lens': '',
    'other/parts/arm.yaml': ARM,
    'other/parts/arm.params.yaml': 'arm: {ros__parameters: {rate: 2}}\n',
    'other/parts/drive_arm.py': TICK,
    'other/parts/hand.yaml': 'version: 1\nnodes: {hand: {}}\n',
}
# The file to load, the file that it includes, and the links.
ARM_FILE = '../other/parts/arm.yaml'
LAYOUTS = {
    'file': ('now.yaml', ARM_FILE, {'now.yaml': 'real/configs/robot.yaml'}),
    'included file': (
        'real/configs/robot.yaml',
        'arm.yaml',
        {'real/configs/arm.yaml': '../other/parts/arm.yaml'},
    ),
    'folder of an included file': (
        'real/configs/robot.yaml',
        'now/../parts/arm.yaml',
        {'real/configs/now': '../other/parts'},
    ),
}


@pytest.fixture(params=LAYOUTS.values(), ids=LAYOUTS)
def linked(request, tmp_path):
    """Write the project with its links, and return the file to load."""
    file, included, links = request.param
    for name, text in FILES.items():
        path = tmp_path / 'real' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace('INCLUDED', included))
    for place, target in links.items():
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).symlink_to(target.format(root=tmp_path))
    return tmp_path / file


def test_all_relative_paths_lie_beside_the_file(linked, tmp_path, monkeypatch):
    monkeypatch.chdir('/')
    assert api.check(linked) == []
    spec = api.load(linked).spec
    configs = tmp_path / 'real/configs'
    assert spec.processes['camera'].command == ('ls', str(configs))
    assert Path(spec.processes['camera'].cwd).samefile(configs / 'camera')
    assert Path(spec.interfaces['shapes']).samefile(tmp_path / 'real/shapes')
    assert set(spec.nodes) == {'robot', 'arm', 'hand'}


@pytest.mark.parametrize('linked', [LAYOUTS['file']], indirect=True)
def test_a_layer_is_read_beside_its_own_file(linked, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    layer = tmp_path / 'real/site/site.yaml'
    layer.parent.mkdir()
    layer.write_text('processes: {camera: {cwd: lens}}\n')
    (tmp_path / 'real/site/lens').mkdir()
    (tmp_path / 'site.yaml').symlink_to('real/site/site.yaml')
    assert cli.run(['show', str(linked), 'site.yaml']) == 0
    assert f'cwd: {tmp_path}/real/site/lens\n' in capsys.readouterr().out
