import sys

import pytest

from composer.interfaces.definitions.definition_parser import (
    DefinitionSyntaxError,
    ParserMissingError,
    load_parser,
    parse_message,
    parse_value,
)

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(
    ('type_text', 'text', 'value'),
    [
        ('int32', '0x10', 16),
        ('bool[]', '[true, 0]', (True, False)),
        ('string', "'it is'", 'it is'),
        ('string[]', '["a,b", c]', ('a,b', 'c')),
        ('float32', '1e3', 1000.0),
    ],
)
def test_values_are_python_values(type_text: str, text: str, value: object) -> None:
    assert parse_value(type_text, text) == value


@pytest.mark.parametrize(
    ('type_text', 'text', 'message'),
    [
        (
            'byte',
            '-1',
            (
                "value '-1' can not be converted to type 'byte': "
                'must be a valid integer value >= 0 and <= 255'
            ),
        ),
        ('std_msgs/Header', '1', 'a field of type std_msgs/Header takes no default value'),
        ('string[]', '[,]', "'[,]' is not a value of type string[]"),
    ],
)
def test_a_wrong_value_is_a_finding(type_text: str, text: str, message: str) -> None:
    with pytest.raises(DefinitionSyntaxError) as caught:
        parse_value(type_text, text)
    assert str(caught.value) == message


def test_a_wrong_message_is_a_finding_and_prints_nothing(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(DefinitionSyntaxError):
        parse_message('p', 'p/msg/M', 'int32 A\n')
    assert capsys.readouterr() == ('', '')


def test_without_rosidl_adapter_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, 'rosidl_adapter.parser', None)
    with pytest.raises(ParserMissingError) as caught:
        load_parser()
    assert str(caught.value) == (
        'interface definitions cannot be read: rosidl_adapter is not installed'
    )
    assert caught.value.help == "install ROS, or pip install 'rclpy-composer[interfaces]'"
