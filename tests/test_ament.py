import sys
from pathlib import Path

import pytest

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package, locate_packages


def test_sourced_prefixes_come_before_that_of_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/opt/ros/overlay:/opt/ros/jazzy:')
    assert ament_prefixes() == [
        Path('/opt/ros/overlay'),
        Path('/opt/ros/jazzy'),
        Path(sys.prefix),
    ]
    monkeypatch.delenv('AMENT_PREFIX_PATH')
    assert ament_prefixes() == [Path(sys.prefix)]


def test_the_first_prefix_that_lists_a_package_has_it(tmp_path: Path) -> None:
    prefixes = [tmp_path / name for name in ('missing', 'one', 'two')]
    for prefix, packages in zip(prefixes[1:], (['a_msgs'], ['a_msgs', 'b_msgs']), strict=True):
        (prefix / INTERFACE_INDEX).mkdir(parents=True)
        for package in packages:
            (prefix / INTERFACE_INDEX / package).touch()
    expected = {'a_msgs': prefixes[1], 'b_msgs': prefixes[2]}
    assert locate_packages(prefixes, INTERFACE_INDEX) == expected
    for package, prefix in expected.items():
        assert find_package(package, prefixes, INTERFACE_INDEX) == prefix
    assert find_package('c_msgs', prefixes, INTERFACE_INDEX) is None
