"""What crosses between workers and hosts, and what is warned of."""

import pytest

from composer.checks.checker import check_system, create_context
from composer.checks.placement.crossings import list_crossings
from composer.cli.main import run
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

SYSTEM = """\
version: 1
{top}
nodes:
  camera:
    {camera}
    publishers: {{image: {{type: sensor_msgs/msg/Image, {image}}}, info: {{type: std_msgs/msg/String, external: true}}}}
    timers: {{take: {{period: 1, behaviour: 'parts:take', publish: image}}}}
    services: {{reset: {{type: std_srvs/srv/Trigger, behaviour: 'parts:reset'}}}}
  detector:
    {detector}
    subscriptions: {{image: {{type: sensor_msgs/msg/Image, behaviour: 'parts:see'}}}}
    service_clients: {{reset: std_srvs/srv/Trigger}}
  recorder:
    {recorder}
    subscriptions: {{image: {{type: sensor_msgs/msg/Image, behaviour: 'parts:see'}}}}
processes:
  viewer: {{{viewer}, command: [viewer], nodes: {{view: {{subscriptions: {{image: sensor_msgs/msg/Image}}}}}}}}
"""
CODE = """
def take(node):
    node.publish('info', 'taken')
    return {'width': 1}

def reset(node, request):
    return {'success': True}

def see(node, image):
    node.call('reset') if node.name == 'detector' else None
"""
CROSSING_RULES = ('unknown-host', 'big-crossing-message', 'not-handed-over', 'no-network-path')
# Where things run, and the lines that tell what crosses.
SPLITS = [
    ({}, []),
    ({'camera': 'worker: eyes', 'detector': 'worker: eyes', 'recorder': 'worker: eyes'}, []),
    (
        {'camera': 'worker: eyes'},
        [
            'topic /image: camera (worker eyes) → detector, recorder',
            'service /reset: detector → camera (worker eyes)',
        ],
    ),
    (
        {'camera': 'worker: eyes', 'detector': 'worker: eyes'},
        ['topic /image: camera (worker eyes) → recorder'],
    ),
    (
        {'camera': 'host: a', 'detector': 'worker: w, host: b', 'recorder': 'host: a', 'viewer': 'host: a'},
        [
            'topic /image: camera (host a) → detector (worker w on host b)',
            'service /reset: detector (worker w on host b) → camera (host a)',
        ],
    ),
    # External processes are processes of their own, but on a host.
    (
        {'camera': 'host: a', 'detector': 'host: a', 'recorder': 'host: a', 'viewer': 'host: b'},
        ['topic /image: camera (host a) → viewer (host b)'],
    ),
]  # fmt: skip


def as_map(text):
    return '\n    '.join(each.strip() for each in text.split(',')) if text else 'description: none'


@pytest.fixture
def load(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'parts.py').write_text(CODE)

    def load(split, *, top='', image='local_delivery: false', system=SYSTEM):
        nodes = {each: as_map(split.get(each, '')) for each in ('camera', 'detector', 'recorder')}
        viewer = split.get('viewer', 'description: none')
        path = tmp_path / 'robot.yaml'
        path.write_text(system.format(top=top or '# none', image=image, viewer=viewer, **nodes))
        return load_system(path)

    return load


@pytest.mark.parametrize(('split', 'lines'), SPLITS)
def test_what_crosses_is_told(load, split, lines):
    context = create_context(load(split), InterfaceCatalogue())
    assert list(map(str, list_crossings(context))) == lines


def test_a_host_that_there_is_not_is_one_finding(load):
    top = 'hosts: {a: {}, b: {address: 10.0.0.2}}\nnetwork: {discovery: discovery_server}'
    split = {
        'camera': 'host: c',
        'detector': 'host: a',
        'recorder': 'host: a',
        'viewer': 'host: a',
    }
    system = load(split, top=top)
    assert list_crossings(create_context(system, InterfaceCatalogue())) == []
    found = [each.rule for each in check_system(system, InterfaceCatalogue())]
    assert [each for each in found if each in CROSSING_RULES] == ['unknown-host']
    # What crosses between others is told.
    system = load(
        {**split, 'recorder': 'host: b', 'camera': 'host: a', 'viewer': 'host: c'}, top=top
    )
    assert list(map(str, list_crossings(create_context(system, InterfaceCatalogue())))) == [
        'topic /image: camera (host a) → recorder (host b)'
    ]


@pytest.mark.ros
@pytest.mark.parametrize(('split', 'lines'), SPLITS)
def test_a_publisher_of_big_messages_is_warned_of_once(load, split, lines):
    found = check_system(load(split), InterfaceCatalogue())
    big = [each for each in found if each.rule == 'big-crossing-message']
    # What an external process gets is serialised in any case.
    expected = any('/image' in line and 'viewer' not in line for line in lines)
    assert [each.span.line for each in big] == ([6] if expected else [])


@pytest.mark.parametrize(('split', 'lines'), SPLITS)
def test_a_promise_to_hand_over_is_kept_by_somebody_beside(load, split, lines):
    found = check_system(load(split, image='local_delivery: true'), InterfaceCatalogue())
    broken = [each for each in found if each.rule == 'not-handed-over']
    # Only in the third case does all that gets the pictures run elsewhere.
    alone = 'camera' in split and len(split) == 1
    assert [each.span.line for each in broken] == ([6] if alone else [])
    assert not alone or 'detector, recorder' in lines[0]


@pytest.mark.parametrize(
    ('image', 'options', 'expected'),
    [
        (
            'local_delivery: false',
            ['--ignore', 'big-crossing-message'],
            'robot.yaml: ok, 3 nodes\n'
            '  crosses: topic /image: camera (worker eyes) → detector, recorder\n'
            '  crosses: service /reset: detector → camera (worker eyes)\n',
        ),
        (
            'local_delivery: true',
            ['--ignore', 'big-crossing-message'],
            '\n\nrobot.yaml:\n'
            '  crosses: topic /image: camera (worker eyes) → detector, recorder\n'
            '  crosses: service /reset: detector → camera (worker eyes)\n',
        ),
        ('local_delivery: false', ['--ignore', 'big-crossing-message', '-q'], ''),
    ],
)
def test_check_says_what_crosses(load, capsys, image, options, expected):
    load({'camera': 'worker: eyes'}, image=image)
    run(['check', 'robot.yaml', *options, '--ignore', 'missing-program'])
    out = capsys.readouterr().out
    assert out.endswith(expected)
    assert expected or not out
