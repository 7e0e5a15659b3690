import shutil
from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import (
    DeclaredPackages,
    load_declared,
    provide_declared,
)
from composer.language.pipeline import load_system

pytestmark = pytest.mark.ros


def test_definitions_are_read_once_for_checks_and_a_start(tmp_path: Path) -> None:
    folder = tmp_path / 'std_msgs'
    (folder / 'msg').mkdir(parents=True)
    (folder / 'msg' / 'Empty.msg').touch()
    path = tmp_path / 'robot.yaml'
    path.write_text(f'version: 1\ninterfaces: {{std_msgs: {folder}}}\nnodes: {{}}\n')
    declared = load_declared(load_system(path), InterfaceCatalogue())
    shutil.rmtree(folder)
    assert declared.findings == []
    (provided,) = provide_declared(declared, print)
    assert provided.package == 'std_msgs'


DEFINITIONS = {
    'arms': {
        'msg/Joint.msg': 'float64 angle\n',
        'msg/Broken.msg': 'nowhere/Thing thing\n',
        'msg/Unused.msg': 'Joint joint\n',
        'srv/Move.srv': 'Pose pose\n---\n',
        'msg/Pose.msg': 'Joint[] joints\n',
        'action/Reach.action': '---\n---\nhands/Grip grip\n',
    },
    'hands': {'msg/Grip.msg': 'float64 force\n', 'msg/Glove.msg': 'string colour\n'},
    'feet': {'msg/Foot.msg': 'arms/Unused unused\n'},
}


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    for package, files in DEFINITIONS.items():
        for name, text in files.items():
            path = tmp_path / package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    return tmp_path


def read(folders: Path, interfaces: str, rest: str = 'nodes: {}') -> DeclaredPackages:
    path = folders / 'robot.yaml'
    path.write_text(f'version: 1\ninterfaces: {interfaces}\n{rest}\n')
    return load_declared(load_system(path), InterfaceCatalogue())


def list_kept(declared: DeclaredPackages) -> dict[str, set[str]]:
    """Return the interfaces that would be built, by package."""
    return {each.package: {*each.names().values()} for each in declared.definitions or ()}


ARMS = '{folder: arms, only: [%s]}'
GRIP = '{folder: hands, only: [msg/Grip]}'


@pytest.mark.parametrize(
    ('interfaces', 'kept'),
    [
        (f'{{arms: {ARMS % "msg/Joint"}}}', 'arms/msg/Joint'),
        (f'{{arms: {ARMS % "srv/Move"}}}', 'arms/srv/Move arms/msg/Pose arms/msg/Joint'),
        (
            f'{{arms: {ARMS % "action/Reach"}, hands: {{folder: hands, only: [msg/Glove]}}}}',
            'arms/action/Reach hands/msg/Grip hands/msg/Glove',
        ),
        (
            f'{{feet: feet, arms: {ARMS % "msg/Joint"}}}',
            'feet/msg/Foot arms/msg/Unused arms/msg/Joint',
        ),
        (f'{{hands: {{folder: hands}}, arms: {ARMS % "msg/Joint"}}}', 'hands/* arms/msg/Joint'),
    ],
)
def test_what_is_listed_is_built_with_the_messages_that_it_uses(
    folders: Path, interfaces: str, kept: str
) -> None:
    declared = read(folders, interfaces)
    assert declared.findings == []
    wanted = kept.replace('hands/*', 'hands/msg/Grip hands/msg/Glove').split()
    assert set().union(*list_kept(declared).values()) == {*wanted}
    assert all(declared.catalogue.has(name) for name in wanted)
    assert not declared.catalogue.has('arms/msg/Broken')


@pytest.mark.parametrize(
    ('inner', 'kept'),
    [
        (GRIP, {'Grip'}),
        ('{folder: hands, only: [msg/Grip, msg/Glove]}', {'Grip', 'Glove'}),
        ('hands', {'Grip', 'Glove'}),
    ],
)
def test_files_of_a_system_get_what_each_of_them_lists(
    folders: Path, inner: str, kept: set[str]
) -> None:
    text = f'version: 1\ninterfaces: {{hands: {inner}}}\nnodes: {{}}\n'
    (folders / 'part.yaml').write_text(text)
    declared = read(folders, f'{{hands: {GRIP}}}', 'include: {part: {file: part.yaml}}')
    assert list_kept(declared) == {'hands': {f'hands/msg/{name}' for name in kept}}


def test_a_wrong_list_is_reported_where_it_stands(folders: Path) -> None:
    text = f'version: 1\ninterfaces: {{hands: {GRIP.replace("]", ", msg/Glov]")}}}\nnodes: {{}}\n'
    (folders / 'part.yaml').write_text(text)
    declared = read(folders, f'{{hands: {GRIP}}}', 'include: {part: {file: part.yaml}}')
    (finding,) = declared.findings
    assert finding.file.endswith('part.yaml')
    assert finding.span is not None
    assert finding.span.text == 'msg/Glov'
    assert finding.message == "the package 'hands' has no 'msg/Glov'"
    assert finding.help == "did you mean 'msg/Glove'?"


def test_code_and_files_that_use_what_is_left_out_are_findings(folders: Path) -> None:
    (folders / 'gloves.py').write_text(
        'def pick():\n    from hands.msg import Glove\n    return {"force": Glove.__sizeof__(1)}\n'
    )
    path = folders / 'robot.yaml'
    path.write_text(
        f'version: 1\ninterfaces: {{hands: {GRIP}}}\nnodes:\n  hand:\n    publishers:\n'
        '      grip: hands/msg/Grip\n      glove: hands/msg/Glove\n'
        '    timers: {t: {rate: 1, behaviour: gloves:pick, publish: grip}}\n'
    )
    findings = check_system(load_system(path), InterfaceCatalogue())
    help_text = "add 'msg/Glove' to 'only:' of 'hands' under 'interfaces:'"
    assert [(error.rule, error.message) for error in findings if error.help == help_text] == [
        ('missing-module', "'only:' of the package 'hands' leaves out 'Glove'"),
        ('unknown-type', "'only:' of the package 'hands' leaves out its message 'Glove'"),
    ]
