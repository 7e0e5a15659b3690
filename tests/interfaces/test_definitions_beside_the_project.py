"""The folder of an interface package stands beside the project, with the package's name."""

import os
import shutil
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from tests.running import ROOT

pytestmark = pytest.mark.ros

_SYSTEM = """
    version: 1
    interfaces: {{example_interfaces: example_interfaces}}
    nodes:
      server:{worker}
        services:
          add: {{type: example_interfaces/srv/AddTwoInts, behaviour: parts:add}}
      client:
        service_clients: {{add: example_interfaces/srv/AddTwoInts}}
        timers:
          ask: {{period: {period}, behaviour: parts:ask}}
    """
_CODE = """
    from example_interfaces.srv import AddTwoInts


    def add(_node, request):
        return AddTwoInts.Response(sum=request.a + request.b)


    def ask(node):
        node.logger.info(f'sum {node.call("add", AddTwoInts.Request(a=1, b=2)).sum}')
    """
_SCENARIO = """
version: 1
system: {file: system.yaml}
cases:
  it adds:
    then:
      - {log: client, text: sum 3, within: [0.0, 1.0]}
    until: 1.0
"""


@pytest.fixture
def project(compose, interface_cache):
    assert interface_cache
    shutil.copytree(
        ROOT / 'interfaces' / 'example_interfaces', compose.folder / 'example_interfaces'
    )

    def write(worker='', period=0.2, code=_CODE):
        return compose.write(_SYSTEM.format(worker=worker, period=period), code)

    write()
    return write


def _composer(folder, *arguments, path=''):
    return subprocess.run(
        [sys.executable, '-m', 'composer', *map(str, arguments)],
        cwd=folder,
        env=os.environ | {'PYTHONPATH': os.pathsep.join([str(ROOT), *([path] if path else [])])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )


def test_the_system_runs_and_an_edit_leaves_what_imports_the_types(compose, project):
    worker = '\n        worker: far'
    child = compose.run(project(worker), '--watch')
    child.wait_for_line('sum 3')
    project(worker, period=0.1)
    assert child.wait_for_line('reloaded in').endswith('~1 timer')
    project(worker, period=0.1, code=_CODE.replace('sum {', 'Sum {'))
    child.wait_for_line('Sum 3')
    assert child.stop() == 0


def test_other_commands_find_the_built_package_too(compose, project):
    path = project('\n        worker: far')
    scenario = compose.folder / 'adds.scenario.yaml'
    scenario.write_text(_SCENARIO)
    for command in (['check', '--import', path], ['test', scenario]):
        ended = _composer('/', *command, path=str(compose.folder))
        assert ended.returncode == 0, ended.stdout


def test_a_module_that_hides_the_package_is_found_by_the_check(compose, project):
    project()
    hiding = compose.folder / 'example_interfaces' / '__init__.py'
    hiding.touch()
    ended = _composer(compose.folder, 'check', 'system.yaml')
    assert ended.returncode == 1
    assert ended.stdout.startswith(
        "system.yaml:3:14: error[bad-name]: 'example_interfaces': "
        f"Python finds '{hiding}' before the interface package\n"
    )
