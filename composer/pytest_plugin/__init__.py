"""A plugin of pytest: scenario files are tests, and tests in Python drive systems.

What it needs is imported by the first scenario file, and by the first test that asks for the
fixture `composer`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from composer.pytest_plugin.scenario_items import ScenarioFile
    from composer.pytest_plugin.tested_systems import TestedSystems

_SUFFIXES = ('.scenario.yaml', '.scenario.yml')
_systems = pytest.StashKey['TestedSystems']()


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    """Collect the cases of scenario files."""
    if not file_path.name.endswith(_SUFFIXES):
        return None
    from composer.pytest_plugin.scenario_items import ScenarioFile

    return ScenarioFile.from_parent(parent, path=file_path)


@pytest.fixture(name='composer')
def composer_fixture(request: pytest.FixtureRequest) -> Iterator[TestedSystems]:
    """Run systems in virtual time: `system = composer('configs/robot.yaml', speed=2.0)`.

    The system has started when the call returns, and is stopped at the end of the test. The
    keywords are values for the arguments that the file declares; `layers`, `set_values` and `seed`
    are as on a command line. Relative paths start at the folder of the test, or at pytest's
    `rootdir`.
    """
    from composer.pytest_plugin.tested_systems import TestedSystems

    systems = TestedSystems(request.path.parent, request.config)
    request.node.stash[_systems] = systems
    try:
        yield systems
    finally:
        systems.stop()
    systems.fail_for_errors()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Add what the systems of a failing test did to its report."""
    systems = item.stash.get(_systems, None)
    if systems is not None and call.when == 'call' and call.excinfo is not None:
        systems.has_failed = True
        for title, text in systems.sections():
            item.add_report_section('call', title, text)
    return (yield)


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process that runs cases, if there is one."""
    from composer.pytest_plugin.case_clients import end_client

    end_client(config)
