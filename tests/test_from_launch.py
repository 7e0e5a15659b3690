"""The page for people who come from launch files: its systems check, and run."""

import os
import re
import stat
import sys
from pathlib import Path

import pytest

import composer
from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.reports.text import render_finding

ROOT = Path(composer.__file__).parents[1]
PAGE = ROOT / 'docs' / 'from_launch.md'

# Stands in for programs of ROS packages that are not installed.
PROGRAM = f"""#!{sys.executable}
import signal
# SIGINT ends the program wherever it is: imports may lose an exception, and rclpy.init() loses what
# comes after its handlers are there, and before the context is.
signal.signal(signal.SIGINT, signal.SIG_DFL)
import rclpy
rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
node = __import__('rclpy.lifecycle').lifecycle.LifecycleNode('program')
publisher = node.create_publisher(__import__('std_msgs.msg').msg.String, 'chatter', 10)
rclpy.spin(node)
"""
EXECUTABLES = {
    'demo_nodes_cpp': 'talker',
    'rclcpp_components': 'component_container',
    'lifecycle': 'lifecycle_talker',
    'robot_state_publisher': 'robot_state_publisher',
    'nav2_map_server': 'map_server',
}


def read_examples():
    """Return the systems of the page: the heading, and the files by name, the system first."""
    examples = []
    for section in re.split(r'^## ', PAGE.read_text(), flags=re.MULTILINE)[1:]:
        heading = section.partition('\n')[0]
        files = {}
        for text in re.findall(r'^```yaml\n(.*?)^```$', section, re.MULTILINE | re.DOTALL):
            name = re.match(r'# (\S+\.yaml)\n', text)
            if not name:
                examples.append((heading, {'system.yaml': text}))
            elif files and name[1] not in files:
                files[name[1]] = text
            else:
                files = {name[1]: text}
                examples.append((heading, files))
    return examples


EXAMPLES = read_examples()
# The last example of each of these does more, as it runs, than start programs.
RUN = (
    'Programs, respawn, shutdown',
    'Event handlers and timers',
)


def test_the_page_shows_each_thing_that_a_launch_file_does():
    assert len(EXAMPLES) >= 16
    text = PAGE.read_text()
    terms = (
        'DeclareLaunchArgument remappings PushRosNamespace GroupAction SetRemap IfCondition '
        'UnlessCondition PythonExpression IncludeLaunchDescription respawn OnProcessExit '
        'OnProcessStart OnShutdown TimerAction SetEnvironmentVariable ExecuteProcess SetParameter '
        'ComposableNode LifecycleNode log-level output'
    )
    for term in terms.split():
        assert term in text


@pytest.fixture
def folder(tmp_path, monkeypatch, shared_cache):
    """Return a folder with the packages that the page uses in an ament prefix below it."""
    prefix = tmp_path / 'prefix'
    index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    for package, executable in EXECUTABLES.items():
        (index / package).touch()
        program = prefix / 'lib' / package / executable
        program.parent.mkdir(parents=True)
        program.write_text(PROGRAM)
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
    # What a container can load.
    (index / 'composition').touch()
    components = index.with_name('rclcpp_components')
    components.mkdir()
    (components / 'composition').write_text('composition::Talker;lib/libtalker.so\n')
    launch_file = prefix / 'share' / 'arm' / 'launch' / 'arm.launch.py'
    launch_file.parent.mkdir(parents=True)
    launch_file.write_text("DeclareLaunchArgument('side')\n")
    (index / 'arm').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    (tmp_path / 'bin').mkdir()
    (tmp_path / 'bin' / 'ros2').write_text(PROGRAM)
    (tmp_path / 'bin' / 'ros2').chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path / 'bin'), prepend=os.pathsep)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(folder, files):
    """Write an example with what the page leaves out; return the system's path and arguments."""
    for name, text in files.items():
        is_whole = 'ros__parameters' in text or name == 'limits.yaml'
        nodes = '' if re.search(r'^nodes:', text, re.MULTILINE) else 'nodes: {}\n'
        (folder / name).write_text(text if is_whole else f'version: 1\n{text}{nodes}')
    (folder / 'arm.urdf').write_text('<robot/>\n')
    first = next(iter(files))
    words = re.search(r'^# arguments: (.*)$', files[first], re.MULTILINE)
    return folder / first, words[1].split() if words else []


@pytest.mark.parametrize(
    'files', [files for _, files in EXAMPLES], ids=[heading for heading, _ in EXAMPLES]
)
def test_an_example_has_no_findings(folder, files):
    path, words = write(folder, files)
    for given in (None, words):
        system = load_system(path, given)
        findings = check_system(system, InterfaceCatalogue())
        assert not findings, '\n'.join(map(render_finding, findings))


@pytest.mark.ros
@pytest.mark.parametrize('heading', RUN)
def test_an_example_runs_and_stops(folder, compose, heading):
    path, words = write(folder, dict(EXAMPLES)[heading])
    child = compose.run(path, *words)
    child.wait_until_ready()
    assert child.stop() == 0, child.output
    # A program that has hardly begun when it is told to end may not end well.
    errors = [line for line in child.matching('[ERROR]') if 'has ended with' not in line]
    assert not errors, child.output
