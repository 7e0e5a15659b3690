import sys
from pathlib import Path
from types import ModuleType

import pytest

from composer.ament import INTERFACE_INDEX
from composer.interfaces.classes import InterfaceNotFoundError, import_interface


def failure(name: str) -> tuple[str, str | None]:
    with pytest.raises(InterfaceNotFoundError) as caught:
        import_interface(name)
    return str(caught.value), caught.value.help


@pytest.mark.ros
@pytest.mark.parametrize(
    ('name', 'attribute'),
    [
        ('std_msgs/msg/String', 'data'),
        ('std_srvs/srv/SetBool', 'Request'),
        ('std_srvs/srv/SetBool_Request', 'data'),
        ('test_msgs/action/Fibonacci', 'Goal'),
    ],
)
def test_interfaces_of_every_kind_are_imported_ready_for_use(name: str, attribute: str) -> None:
    interface = import_interface(name)
    assert interface.__name__ == name.rpartition('/')[-1]
    assert hasattr(interface, attribute)
    assert type(interface)._TYPE_SUPPORT is not None  # type: ignore[attr-defined]


def test_a_package_that_is_not_installed_is_named() -> None:
    assert failure('qqq_zzz/msg/String') == (
        "qqq_zzz/msg/String: the package 'qqq_zzz' is not installed",
        "install it, or name the folder of its definitions under 'interfaces:'",
    )


def test_a_package_that_only_tools_find_is_not_called_absent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    index = tmp_path / INTERFACE_INDEX
    index.mkdir(parents=True)
    (index / 'qqq_zzz').write_text('msg/String.msg\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert failure('qqq_zzz/msg/String') == (
        "qqq_zzz/msg/String: the package 'qqq_zzz' is installed, but Python finds no module of it",
        'source the setup file of its workspace, which sets PYTHONPATH',
    )


@pytest.mark.ros
@pytest.mark.parametrize(
    ('name', 'message', 'advice'),
    [
        (
            'std_msg/msg/String',
            "std_msg/msg/String: the package 'std_msg' is not installed",
            "did you mean 'std_msgs'?",
        ),
        (
            'std_srvs/msg/SetBool',
            "std_srvs/msg/SetBool: the package 'std_srvs' has no messages",
            "did you mean 'std_srvs/srv/SetBool'?",
        ),
        (
            'sensor_msgs/msg/SetCameraInfo',
            (
                "sensor_msgs/msg/SetCameraInfo: 'SetCameraInfo' is not one of the messages of "
                "'sensor_msgs'"
            ),
            "did you mean 'sensor_msgs/srv/SetCameraInfo'?",
        ),
        (
            'std_msgs/msg/Strin',
            "std_msgs/msg/Strin: 'Strin' is not one of the messages of 'std_msgs'",
            "did you mean 'std_msgs/msg/String'?",
        ),
        (
            'std_msgs/String',
            "'std_msgs/String' is not the name of an interface",
            "did you mean 'std_msgs/msg/String'?",
        ),
        (
            'Twist',
            "'Twist' is not the name of an interface",
            "did you mean 'geometry_msgs/msg/Twist'?",
        ),
        (
            'rclpy/action/ActionClient',
            'rclpy/action/ActionClient is a class, but not a ROS interface',
            None,
        ),
    ],
)
def test_each_way_to_be_wrong_has_its_own_message(
    name: str,
    message: str,
    advice: str | None,
) -> None:
    assert failure(name) == (message, advice)


@pytest.mark.parametrize('name', ['', '///', 'a/msg/b c', '../msg/X', 'std_msgs/msg/_string'])
def test_what_is_no_name_is_never_imported(name: str) -> None:
    assert failure(name) == (
        f'{name!r} is not the name of an interface',
        'write it in full: std_msgs/msg/String',
    )


BROKEN_HELP = (
    'its compiled type support, or a library that it needs, is missing or was built for another '
    'Python or ROS: install or build the package again'
)


def test_a_package_that_fails_to_import_says_why(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    package = tmp_path / 'broken_a_msgs'
    (package / 'msg').mkdir(parents=True)
    (package / '__init__.py').touch()
    (package / 'msg/__init__.py').write_text('import a_module_that_is_missing')
    monkeypatch.syspath_prepend(tmp_path)
    assert failure('broken_a_msgs/msg/Number') == (
        (
            'broken_a_msgs/msg/Number is installed but cannot be loaded: '
            "No module named 'a_module_that_is_missing'"
        ),
        BROKEN_HELP,
    )


def test_type_support_that_does_not_load_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def load_library() -> None:
        message = 'libbroken.so: cannot open shared object file'
        raise ImportError(message)

    class Metaclass(type):
        _TYPE_SUPPORT = None

        @classmethod
        def __import_type_support__(cls) -> None:
            # As rosidl_generator_py does: the reason is only in the context.
            try:
                load_library()
            except ImportError:
                raise LookupError  # noqa: B904

    module = ModuleType('broken_b_msgs.msg')
    module.Number = Metaclass('Number', (), {})  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'broken_b_msgs', ModuleType('broken_b_msgs'))
    monkeypatch.setitem(sys.modules, 'broken_b_msgs.msg', module)
    assert failure('broken_b_msgs/msg/Number') == (
        (
            'broken_b_msgs/msg/Number is installed but cannot be loaded: '
            'libbroken.so: cannot open shared object file'
        ),
        BROKEN_HELP,
    )
