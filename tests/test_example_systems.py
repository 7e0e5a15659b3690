"""The commands of docs/examples.md, each done as `ros2 topic` does it, and what they print."""

import re
import shlex
import sys
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest
import yaml

pytest.importorskip('rclpy')

from rclpy.qos import qos_profile_sensor_data

from composer.runtime.messages.payloads import converter_for

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parent.parent
BLOCKS = re.findall(
    r'^```console\n(.*?)^```', (ROOT / 'docs/examples.md').read_text(), re.MULTILINE | re.DOTALL
)


def message_class(name):
    package, _, kind = name.split('/')
    return getattr(import_module(f'{package}.msg'), kind)


def publish(peer, words):
    """Publish what `ros2 topic pub TOPIC TYPE VALUES` does, each time that it is called."""
    topic, name, values = words
    publisher = peer.advertise(message_class(name), topic)
    message = converter_for(message_class(name)).convert(yaml.safe_load(values))
    return lambda: publisher.publish(message)


def echo(peer, wait_for, words, publishers):
    """Return what `ros2 topic echo --once [--field NAME] TOPIC` prints."""
    topic, field = words[-1], words[words.index('--field') + 1] if '--field' in words else None
    types = wait_for(lambda: dict(peer.node.get_topic_names_and_types()).get(topic), topic)
    heard = peer.listen(message_class(types[0]), topic, qos_profile_sensor_data)

    def came():
        for publish_once in publishers:
            publish_once()
        return heard

    (message, *_) = wait_for(came, f'a message on {topic}')
    if field is None:
        return f'data: {message.data}\n---\n'
    return f'{reduce(getattr, field.split("."), message)}\n---\n'


@pytest.mark.parametrize(
    'block', BLOCKS, ids=[re.search(r'(\w+)\.yaml', each)[1] for each in BLOCKS]
)
def test_the_commands_of_an_example_print_what_the_page_says(
    compose, peer, wait_for, monkeypatch, block
):
    monkeypatch.setenv('PATH', str(Path(sys.executable).parent), prepend=':')
    publishers = []
    for command, output in re.findall(r'^\$ (.*)\n((?:(?!\$).*\n)*)', block, re.MULTILINE):
        program, verb, *words = shlex.split(command.removesuffix(' &'))
        match program, verb, words:
            case 'composer', 'up', [path]:
                child = compose.run(path, folder=ROOT)
                child.wait_until_ready()
                child.wait_for_line(re.search(r'\[composer\]: .* ready', output)[0])
            case 'ros2', 'topic', ['pub', *rest]:
                publishers.append(publish(peer, rest))
            case 'ros2', 'topic', ['echo', '--once', *rest]:
                assert echo(peer, wait_for, rest, publishers) == output
            case _:
                pytest.fail(f'the test does not know {command}')
    assert child.stop() == 0
