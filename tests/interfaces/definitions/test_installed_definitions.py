import shutil
from pathlib import Path

import pytest

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.interfaces.definitions.installed_definitions import describe_interface
from composer.interfaces.descriptions import MessageDescription

pytestmark = pytest.mark.ros


def test_an_installed_message_is_described_with_its_comments_and_constants() -> None:
    header = describe_interface('std_msgs/msg/Header', ament_prefixes())
    assert isinstance(header, MessageDescription)
    assert header.comment.startswith('Standard metadata for higher-level stamped data types.')
    assert [(str(each.type), each.name, each.comment) for each in header.fields] == [
        (
            'builtin_interfaces/msg/Time',
            'stamp',
            'Two-integer timestamp that is expressed as seconds and nanoseconds.',
        ),
        ('string', 'frame_id', 'Transform frame with which this data is associated.'),
    ]
    log = describe_interface('rcl_interfaces/msg/Log', ament_prefixes())
    assert isinstance(log, MessageDescription)
    assert [(each.name, each.value) for each in log.constants[:2]] == [
        ('DEBUG', 10),
        ('INFO', 20),
    ]


@pytest.mark.parametrize('name', ['std_msgs/msg/Heeder', 'no_msgs/msg/Header'])
def test_what_is_not_installed_has_no_description(name: str) -> None:
    assert describe_interface(name, ament_prefixes()) is None


def test_a_package_without_definition_files_is_described_by_its_type_descriptions(
    tmp_path: Path,
) -> None:
    prefix = find_package('std_msgs', ament_prefixes(), INTERFACE_INDEX)
    assert prefix is not None
    for relative in (f'{INTERFACE_INDEX}/std_msgs', 'share/std_msgs/msg/Header.json'):
        (tmp_path / relative).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(prefix / relative, tmp_path / relative)
    header = describe_interface('std_msgs/msg/Header', [tmp_path])
    assert isinstance(header, MessageDescription)
    assert [field.name for field in header.fields] == ['stamp', 'frame_id']
    assert header.comment == ''
