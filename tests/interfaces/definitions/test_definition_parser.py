import sys

import pytest

from composer.interfaces.definitions.definition_parser import (
    DefinitionSyntaxError,
    ParserMissingError,
    load_parser,
    parse_message,
)

pytestmark = pytest.mark.ros


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
