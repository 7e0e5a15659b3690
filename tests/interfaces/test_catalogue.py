import json
import subprocess
import sys
from pathlib import Path

import pytest

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.descriptions import (
    ActionDescription,
    FieldDescription,
    FieldType,
    MessageDescription,
    ServiceDescription,
)

NUMBER = MessageDescription('my_msgs/msg/Number', (FieldDescription('data', FieldType('int32')),))


def install(prefix: Path, package: str, lines: list[str], **type_ids: int) -> None:
    """Lay a package out as ament does: a line per definition, a description per message."""
    index = prefix / 'share/ament_index/resource_index/rosidl_interfaces'
    index.mkdir(parents=True, exist_ok=True)
    (index / package).write_text('\n'.join(lines))
    folder = prefix / 'share' / package / 'msg'
    folder.mkdir(parents=True)
    for name, type_id in type_ids.items():
        full_name = f'{package}/msg/{name}'
        kind = {'type_id': type_id, 'capacity': 0, 'string_capacity': 0, 'nested_type_name': ''}
        fields = [{'name': 'data', 'type': kind, 'default_value': ''}]
        content = {
            'type_description_msg': {
                'type_description': {'type_name': full_name, 'fields': fields},
                'referenced_type_descriptions': [],
            },
        }
        (folder / f'{name}.json').write_text(json.dumps(content))


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    lines = [
        'msg/Number.idl',
        'msg/Number.msg',
        'msg/Bare.msg',
        'msg/Wide.idl',
        'srv/Ask.idl',
        'srv/Ask.srv',
        'srv/Ask_Request.msg',
        'action/Go.action',
    ]
    install(tmp_path / 'one', 'my_msgs', lines, Number=6, Wide=14, Bent=6)
    (tmp_path / 'one/share/my_msgs/msg/Bent.json').write_text('{"type_description_msg": ')
    return tmp_path / 'one'


def test_interfaces_are_listed_once_by_kind_and_package(prefix: Path) -> None:
    install(prefix, 'your_msgs', ['msg/Text.idl', 'msg/Text.msg'])
    catalogue = InterfaceCatalogue([prefix])
    assert catalogue.packages() == ['my_msgs', 'your_msgs']
    assert catalogue.names('msg', 'my_msgs') == [
        'my_msgs/msg/Bare',
        'my_msgs/msg/Number',
        'my_msgs/msg/Wide',
    ]
    assert catalogue.names('msg')[-1] == 'your_msgs/msg/Text'
    assert catalogue.names('action') == ['my_msgs/action/Go']
    assert catalogue.names('srv', 'nobodys_msgs') == []


def test_the_messages_that_old_generators_list_for_services_are_no_services(prefix: Path) -> None:
    assert InterfaceCatalogue([prefix]).names('srv') == ['my_msgs/srv/Ask']


def test_a_description_comes_from_the_installed_file(prefix: Path) -> None:
    assert InterfaceCatalogue([prefix]).describe('my_msgs/msg/Number') == NUMBER


def test_a_file_is_read_once(prefix: Path) -> None:
    catalogue = InterfaceCatalogue([prefix])
    first = catalogue.describe('my_msgs/msg/Number')
    (prefix / 'share/my_msgs/msg/Number.json').unlink()
    assert catalogue.describe('my_msgs/msg/Number') is first


@pytest.mark.parametrize(
    'name',
    [
        'my_msgs/msg/Missing',
        'my_msgs/msg/Bare',
        'my_msgs/msg/Bent',
        'my_msgs/msg/Wide',
        'nobodys_msgs/msg/Number',
        'my_msgs/Number',
        'my_msgs/other/Number',
        'Number',
        '',
    ],
)
def test_what_has_no_readable_description_is_none(prefix: Path, name: str) -> None:
    assert InterfaceCatalogue([prefix]).describe(name) is None


def test_the_first_prefix_with_a_package_counts(prefix: Path, tmp_path: Path) -> None:
    install(tmp_path / 'two', 'my_msgs', ['msg/Number.msg'], Number=11)
    other = MessageDescription(NUMBER.name, (FieldDescription('data', FieldType('float64')),))
    listed_first = InterfaceCatalogue([tmp_path / 'two', prefix])
    listed_first.packages()
    for catalogue in (InterfaceCatalogue([tmp_path / 'two', prefix]), listed_first):
        assert catalogue.describe('my_msgs/msg/Number') == other
        assert catalogue.names('msg') == ['my_msgs/msg/Number']
    own_first = InterfaceCatalogue([prefix, tmp_path / 'two'])
    assert own_first.describe('my_msgs/msg/Number') == NUMBER


def test_added_descriptions_count_before_installed_ones(prefix: Path) -> None:
    catalogue = InterfaceCatalogue([prefix])
    other = MessageDescription('my_msgs/msg/Number', ())
    catalogue.add(other)
    assert catalogue.describe('my_msgs/msg/Number') is other
    assert catalogue.names('msg', 'my_msgs').count('my_msgs/msg/Number') == 1


def test_without_ros_there_is_nothing_and_that_is_no_error(tmp_path: Path) -> None:
    catalogue = InterfaceCatalogue([tmp_path / 'missing'])
    assert not catalogue.available
    assert catalogue.packages() == catalogue.names('msg') == []
    assert catalogue.describe('std_msgs/msg/String') is None


@pytest.mark.ros
def test_every_installed_interface_is_described() -> None:
    catalogue = InterfaceCatalogue()
    kinds = {'msg': MessageDescription, 'srv': ServiceDescription, 'action': ActionDescription}
    described = 0
    for kind, record in kinds.items():
        for name in catalogue.names(kind):  # type: ignore[arg-type]
            assert isinstance(catalogue.describe(name), record), name
            described += 1
    assert described > 100


@pytest.mark.ros
def test_describing_imports_neither_ros_nor_messages_nor_numpy() -> None:
    code = (
        'import sys\n'
        'from composer.interfaces.catalogue import InterfaceCatalogue\n'
        'catalogue = InterfaceCatalogue()\n'
        "assert catalogue.describe('geometry_msgs/msg/PoseWithCovariance')\n"
        "loaded = {'rclpy', 'rosidl_parser', 'geometry_msgs', 'numpy'} & sys.modules.keys()\n"
        'assert not loaded, loaded\n'
    )
    subprocess.run([sys.executable, '-c', code], check=True, timeout=200)
