import sysconfig
from pathlib import Path

import pytest

from composer.ament import ament_prefixes
from composer.interfaces.build.toolchain import BuildToolsMissingError, find_toolchain

pytestmark = pytest.mark.ros


def missing(prefixes: list[Path]) -> BuildToolsMissingError:
    with pytest.raises(BuildToolsMissingError) as caught:
        find_toolchain(prefixes)
    return caught.value


def test_all_that_a_build_needs_is_found() -> None:
    toolchain = find_toolchain(ament_prefixes())
    assert Path(toolchain.c[0]).is_file()
    assert Path(toolchain.cxx[0]).is_file()
    assert [folder.is_dir() for folder in toolchain.python_includes] == [True, True]


def test_missing_compilers_are_both_named(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    error = missing(ament_prefixes())
    assert str(error) == (
        'interface packages cannot be built: there is no C compiler, no C++ compiler'
    )
    assert error.help == 'install gcc and g++ (Debian, Ubuntu: apt install g++)'


def test_compilers_may_be_named_with_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('CC', 'env gcc')
    toolchain = find_toolchain(ament_prefixes())
    assert (Path(toolchain.c[0]).name, toolchain.c[1:]) == ('env', ('gcc',))
    monkeypatch.setenv('CXX', 'no-such-compiler')
    error = missing(ament_prefixes())
    assert error.missing == ("C++ compiler 'no-such-compiler'",)
    assert error.help == 'CXX names it: correct or unset it'


def test_missing_python_headers_are_named(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(sysconfig, 'get_path', lambda _: str(tmp_path))
    error = missing(ament_prefixes())
    assert error.missing == (f'Python.h in {tmp_path}',)
    assert error.help == "install Python's headers (Debian, Ubuntu: apt install python3-dev)"


def test_missing_generators_are_named(tmp_path: Path) -> None:
    error = missing([tmp_path])
    assert 'rosidl_generator_c in share' in str(error)
    assert error.help is not None
    assert "pip install 'rclpy-composer[interfaces]'" in error.help
