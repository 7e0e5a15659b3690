import shutil
from pathlib import Path

import pytest

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import load_declared, provide_declared
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
