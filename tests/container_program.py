"""The container of the example, with other components: a program for tests to run.

They are those of the package `stand_in`, and of any other there are none:

- `stand_in::Talker` publishes its parameter `word` on `chatter`.
- `stand_in::Slow` takes as long as a file `slow` is there.
- `stand_in::Broken` raises in its constructor.
- `stand_in::Managed` has a lifecycle.

As those of Jazzy, they have no services for the levels of their loggers; with a file `levels`, they
have them, as those of Kilted.
"""

import sys
import time
from pathlib import Path

from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String

sys.path.append(str(Path(__file__).resolve().parents[1] / 'configs' / 'programs'))

from component_container import run


class Talker(Node):
    def __init__(self, name, **options):
        super().__init__(
            name,
            automatically_declare_parameters_from_overrides=True,
            enable_logger_service=Path('levels').exists(),
            **options,
        )
        self.publisher = self.create_publisher(String, 'chatter', 10)
        self.timer = self.create_timer(0.05, self.say)

    def say(self):
        word = self.get_parameter_or('word', Parameter('word', value='hello')).value
        self.get_logger().debug('says a word')
        self.publisher.publish(String(data=str(word)))


class Slow(Talker):
    def __init__(self, name, **options):
        while Path('slow').exists():
            time.sleep(0.02)
        super().__init__(name, **options)


class Broken(Talker):
    def __init__(self, name, **options):
        message = 'no such device'
        raise RuntimeError(message)


class Managed(LifecycleNode):
    pass


KINDS = (Talker, Slow, Broken, Managed)
CLASSES = {f'stand_in::{each.__name__}': each for each in KINDS}
CLASSES['composition::Talker'] = Talker


if __name__ == '__main__':
    run(CLASSES)
