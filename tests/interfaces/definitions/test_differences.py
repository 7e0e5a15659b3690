import shutil
from pathlib import Path

import pytest
from building import WriteDefinitions

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.interfaces.definitions.differences import (
    DefinitionsDifferError,
    compare_definitions,
    require_same,
)
from composer.interfaces.definitions.package_folder import load_definitions

pytestmark = pytest.mark.ros


def installed_in(package: str) -> Path:
    prefix = find_package(package, ament_prefixes(), INTERFACE_INDEX)
    assert prefix is not None
    return prefix


def test_comments_and_missing_interfaces_make_no_difference(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions(
        {
            'msg/ColorRGBA.msg': '# Ours.\nfloat32 r # red\nfloat32 g\nfloat32 b\nfloat32 a\n',
            'msg/Char.msg': 'char data\n',
        }
    )
    require_same(load_definitions('std_msgs', folder), installed_in('std_msgs'))


def test_a_difference_is_shown(write_definitions: WriteDefinitions) -> None:
    changed = 'bool data\n---\nstring message\nbool success\n'
    folder = write_definitions({'srv/SetBool.srv': changed})
    prefix = installed_in('std_srvs')
    with pytest.raises(DefinitionsDifferError) as caught:
        require_same(load_definitions('std_srvs', folder), prefix)
    assert str(caught.value) == (
        f'std_srvs is installed in {prefix}, and {folder} defines it differently:\n'
        f'--- {prefix}/share/std_srvs/srv/SetBool.srv\n'
        f'+++ {folder}/srv/SetBool.srv\n'
        '@@ -2,3 +2,3 @@\n'
        ' ---\n'
        '+string message\n'
        ' bool success\n'
        '-string message'
    )
    assert [each.name for each in caught.value.differences] == ['std_srvs/srv/SetBool']


@pytest.mark.parametrize('text', ['uint8 DEBUG=11\n', 'uint8 DEBUG=10\nbyte EXTRA=1\n'])
def test_constants_make_a_difference(write_definitions: WriteDefinitions, text: str) -> None:
    prefix = installed_in('rcl_interfaces')
    original = (prefix / 'share/rcl_interfaces/msg/Log.msg').read_text()
    folder = write_definitions({'msg/Log.msg': original.replace('uint8 DEBUG=10\n', text)})
    [difference] = compare_definitions(load_definitions('rcl_interfaces', folder), prefix)
    assert difference.name == 'rcl_interfaces/msg/Log'


def test_a_char_is_the_uint8_of_a_package_without_definition_files(
    write_definitions: WriteDefinitions,
    tmp_path: Path,
) -> None:
    for relative in (f'{INTERFACE_INDEX}/std_msgs', 'share/std_msgs/msg/Char.json'):
        (tmp_path / relative).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(installed_in('std_msgs') / relative, tmp_path / relative)
    folder = write_definitions({'msg/Char.msg': 'char data\n'})
    assert compare_definitions(load_definitions('std_msgs', folder), tmp_path) == []


def test_an_interface_that_is_not_installed_is_a_difference(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions({'msg/Extra.msg': 'int32 a\n'})
    [difference] = compare_definitions(
        load_definitions('std_msgs', folder),
        installed_in('std_msgs'),
    )
    assert difference.diff.splitlines() == [
        '--- (not installed)',
        f'+++ {folder}/msg/Extra.msg',
        '@@ -0,0 +1 @@',
        '+int32 a',
    ]
