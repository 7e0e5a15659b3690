from pathlib import Path

import pytest
from building import SHIPPED, WriteDefinitions

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.package_folder import PackageDefinitions, load_definitions
from composer.interfaces.descriptions import (
    ActionDescription,
    ConstantDescription,
    FieldDescription,
    FieldType,
    MessageDescription,
    ServiceDescription,
)

pytestmark = pytest.mark.ros


def places(definitions: PackageDefinitions) -> list[tuple[str, int, str]]:
    """List file, line and rule of all that is wrong."""
    return [
        (Path(each.file).name, each.span.line if each.span else 0, each.rule)
        for each in definitions.diagnostics
    ]


def test_a_message_is_described_with_fields_constants_and_comments(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions(
        {
            'msg/Robot.msg': (
                '# A robot.\n\nuint8 IDLE=0  # waits\n# How fast it goes.\nfloat64 speed 1.5  # [m/s]\n'
                'string<=8[<=3] names ["a"]\nstd_msgs/Header header\nOther[2] others\nchar[] letters\n'
            )
        }
    )
    definitions = load_definitions('robots', folder)
    assert definitions.diagnostics == ()
    assert definitions.interfaces == {
        'robots/msg/Robot': MessageDescription(
            'robots/msg/Robot',
            fields=(
                FieldDescription('speed', FieldType('float64'), 1.5, 'How fast it goes.\n[m/s]'),
                FieldDescription('names', FieldType('string', None, 8, 'bounded', 3), ('a',)),
                FieldDescription('header', FieldType('message', 'std_msgs/msg/Header')),
                FieldDescription(
                    'others',
                    FieldType('message', 'robots/msg/Other', None, 'fixed', 2),
                ),
                FieldDescription('letters', FieldType('char', array='unbounded')),
            ),
            constants=(ConstantDescription('IDLE', FieldType('uint8'), 0, 'waits'),),
            comment='A robot.',
        )
    }
    assert [reference.message for reference in definitions.references] == [
        'std_msgs/Header',
        'robots/Other',
    ]


def test_services_and_actions_are_described_by_their_parts(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions(
        {
            'srv/Ask.srv': 'int32 a\n---\nint32 b\n',
            'action/Go.action': 'int32 goal\n---\n---\nint32 way\n',
        }
    )
    interfaces = load_definitions('robots', folder).interfaces
    service = interfaces['robots/srv/Ask']
    action = interfaces['robots/action/Go']
    assert isinstance(service, ServiceDescription)
    assert (service.request.name, service.request.fields[0].name) == (
        'robots/srv/Ask_Request',
        'a',
    )
    assert isinstance(action, ActionDescription)
    assert action.result == MessageDescription('robots/action/Go_Result', ())
    assert action.feedback.fields[0].name == 'way'


def test_all_findings_are_found_in_one_pass(write_definitions: WriteDefinitions) -> None:
    folder = write_definitions(
        {
            'msg/Robot.msg': 'int a\nint32 b\nint32 b\nuint8 C=300\nuint8 C=1\nint32 Wrong\n---\n',
            'msg/bad_name.msg': 'int32 a\n',
            'srv/Lost.srv': 'int32 a\nint32 b\n',
            'srv/Sloppy.srv': 'int32 a\n--- \nstring<=x b\n',
            'srv/Many.srv': '---\n---\n',
            'action/Half.action': '---\nint32\n',
            'action/Moved.msg': 'int32 a\n',
        }
    )
    definitions = load_definitions('robots', folder)
    assert places(definitions) == [
        ('Moved.msg', 0, 'misplaced-file'),
        ('Robot.msg', 1, 'unknown-type'),
        ('Robot.msg', 3, 'duplicate-field'),
        ('Robot.msg', 4, 'bad-constant'),
        ('Robot.msg', 5, 'duplicate-constant'),
        ('Robot.msg', 6, 'bad-name'),
        ('Robot.msg', 7, 'bad-separator'),
        ('bad_name.msg', 0, 'bad-name'),
        ('Lost.srv', 2, 'missing-separator'),
        ('Many.srv', 2, 'bad-separator'),
        ('Sloppy.srv', 2, 'bad-separator'),
        ('Sloppy.srv', 3, 'bad-type'),
        ('Half.action', 2, 'missing-separator'),
        ('Half.action', 2, 'missing-name'),
    ]
    assert definitions.interfaces == {}


def test_a_duplicate_shows_the_first_one(write_definitions: WriteDefinitions) -> None:
    folder = write_definitions({'msg/Robot.msg': 'int32 a\n\nfloat64 a\n'})
    [diagnostic] = load_definitions('robots', folder).diagnostics
    assert str(diagnostic.span) == f'{folder}/msg/Robot.msg:3:9'
    assert diagnostic.message == "the field 'a' is already defined"
    assert diagnostic.help == 'the first one is on line 1'
    assert [str(related.span) for related in diagnostic.related] == [
        f'{folder}/msg/Robot.msg:1:7',
    ]


def test_text_that_is_not_utf_8_is_found_on_its_line(tmp_path: Path) -> None:
    (tmp_path / 'msg').mkdir()
    (tmp_path / 'msg' / 'Robot.msg').write_bytes(b'int32 a\nint32 b # \xff\n')
    assert places(load_definitions('robots', tmp_path)) == [('Robot.msg', 2, 'not-utf-8')]


def test_a_folder_without_definitions_is_a_finding(tmp_path: Path) -> None:
    [diagnostic] = load_definitions('robots', tmp_path / 'missing').diagnostics
    assert (diagnostic.rule, diagnostic.file) == ('no-definitions', str(tmp_path / 'missing'))


def test_a_wrong_package_name_is_a_finding(write_definitions: WriteDefinitions) -> None:
    folder = write_definitions({'msg/Robot.msg': 'int32 a\n'})
    assert places(load_definitions('Robots', folder)) == [(folder.name, 0, 'bad-name')]


@pytest.mark.parametrize('package', InterfaceCatalogue().packages())
def test_installed_definitions_have_no_findings(package: str) -> None:
    prefix = find_package(package, ament_prefixes(), INTERFACE_INDEX)
    assert prefix is not None
    definitions = load_definitions(package, prefix / 'share' / package)
    assert definitions.diagnostics == ()
    assert set(definitions.interfaces) == {
        name
        for kind in ('msg', 'srv', 'action')
        for name in InterfaceCatalogue().names(kind, package)
        # Some of test_msgs are written in IDL since Kilted.
        if (prefix / 'share' / f'{name}.{kind}').exists()
    }


def test_shipped_definitions_have_no_findings() -> None:
    for folder in SHIPPED.iterdir():
        assert load_definitions(folder.name, folder).diagnostics == ()
