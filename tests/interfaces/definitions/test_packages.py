from collections.abc import Mapping

import pytest
from building import WriteDefinitions

from composer.diagnostics import Diagnostic
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.package_folder import load_definitions
from composer.interfaces.definitions.packages import (
    DefinitionsError,
    check_definitions,
    load_packages,
    order_packages,
    used_packages,
)

pytestmark = pytest.mark.ros


def check(write: WriteDefinitions, **packages: Mapping[str, str]) -> list[Diagnostic]:
    definitions = [load_definitions(name, write(files)) for name, files in packages.items()]
    return check_definitions(definitions, InterfaceCatalogue())


@pytest.mark.parametrize(
    ('type_text', 'rule', 'message', 'advice'),
    [
        (
            'geometry_msg/Point',
            'unknown-package',
            "there is no interface package 'geometry_msg'",
            "did you mean 'geometry_msgs/Point'?",
        ),
        (
            'qqq/Point',
            'unknown-package',
            "there is no interface package 'qqq'",
            'install it, or name the folder of its definitions under interfaces',
        ),
        (
            'geometry_msgs/Pont[]',
            'unknown-type',
            "geometry_msgs has no message 'Pont'",
            "did you mean 'geometry_msgs/Point'?",
        ),
        (
            'Header',
            'unknown-type',
            "there is no type 'Header': robots has no such message",
            "did you mean 'std_msgs/Header'?",
        ),
        (
            'Robto',
            'unknown-type',
            "there is no type 'Robto': robots has no such message",
            "did you mean 'Robot'?",
        ),
    ],
)
def test_an_unknown_message_has_a_suggestion(
    write_definitions: WriteDefinitions,
    type_text: str,
    rule: str,
    message: str,
    advice: str,
) -> None:
    [diagnostic] = check(
        write_definitions,
        robots={'msg/Robot.msg': 'int32 a\n', 'msg/User.msg': f'\n{type_text} b\n'},
        other={'msg/Thing.msg': 'int32 a\n'},
    )
    assert (diagnostic.rule, diagnostic.message, diagnostic.help) == (rule, message, advice)
    assert diagnostic.span is not None
    assert (diagnostic.span.line, diagnostic.span.text) == (2, type_text)


def test_messages_of_the_same_of_other_and_of_installed_packages_are_known(
    write_definitions: WriteDefinitions,
) -> None:
    assert (
        check(
            write_definitions,
            robots={
                'msg/Robot.msg': 'other/Thing[<=3] a\nstd_msgs/Header b\n',
                'srv/Ask.srv': 'Robot a\n---\nrobots/Robot b\n',
            },
            other={'msg/Thing.msg': 'builtin_interfaces/Time a\n'},
        )
        == []
    )


def test_a_message_cannot_contain_itself(write_definitions: WriteDefinitions) -> None:
    [diagnostic] = check(
        write_definitions,
        robots={
            'msg/A.msg': 'B b\n',
            'msg/B.msg': 'int32 x\nA[] a\n',
        },
    )
    assert diagnostic.rule == 'endless-type'
    assert diagnostic.message.startswith('a message contains itself: robots/msg/')


def test_packages_cannot_use_each_other(write_definitions: WriteDefinitions) -> None:
    [diagnostic] = check(
        write_definitions,
        one={'msg/A.msg': 'two/B b\n', 'msg/C.msg': 'int32 c\n'},
        two={'msg/B.msg': 'int32 a\n', 'msg/D.msg': 'one/C c\n'},
    )
    assert diagnostic.rule == 'circular-packages'


def test_packages_are_ordered_by_use(write_definitions: WriteDefinitions) -> None:
    one = load_definitions('one', write_definitions({'msg/A.msg': 'two/B b\n'}))
    two = load_definitions('two', write_definitions({'msg/B.msg': 'std_msgs/Header b\n'}))
    assert [each.package for each in order_packages([one, two])] == ['two', 'one']
    assert used_packages(one) == {'two'}


def test_services_and_actions_use_packages_of_their_own(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions({'action/Go.action': '---\n---\n'})
    assert used_packages(load_definitions('robots', folder)) == {
        'action_msgs',
        'builtin_interfaces',
        'service_msgs',
        'unique_identifier_msgs',
    }


def test_wrong_definitions_are_one_error_with_all_findings(
    write_definitions: WriteDefinitions,
) -> None:
    folder = write_definitions({'msg/A.msg': 'strng a\n', 'msg/B.msg': 'std_mgs/Header a\n'})
    with pytest.raises(DefinitionsError) as caught:
        load_packages({'robots': folder}, InterfaceCatalogue())
    assert [each.rule for each in caught.value.diagnostics] == ['unknown-type', 'unknown-package']
    assert str(caught.value) == (
        f"{folder}/msg/A.msg:1:1: error[unknown-type]: there is no type 'strng'\n"
        "  help: did you mean 'string'?\n"
        f'{folder}/msg/B.msg:1:1: error[unknown-package]: '
        "there is no interface package 'std_mgs'\n"
        "  help: did you mean 'std_msgs/Header'?"
    )
