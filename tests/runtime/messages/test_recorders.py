"""Recorders that come and go miss nothing while they are there, and disturb nobody.

`python -m tests.runtime.messages.test_recorders SEED COUNT` plays on.
"""

import os
import sys
import tempfile
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from tests.runtime.messages.recorders import playing

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(('seed', 'turns'), [(1, 2), pytest.param(2, 12, marks=pytest.mark.long)])
def test_recorders_that_come_and_go_disturb_nobody(tmp_path, domain_id, seed, turns):
    with playing(tmp_path, seed, domain_id) as game:
        for _ in range(turns):
            game.play()
        game.kill()
        game.play()


if __name__ == '__main__':
    seed, count = map(int, sys.argv[1:])
    domain = int(os.environ['ROS_DOMAIN_ID'])
    with tempfile.TemporaryDirectory() as folder, playing(Path(folder), seed, domain) as game:
        for number in range(count):
            if number % 100 == 99:
                game.kill()
            print(number, *game.play(), flush=True)
    print('published', dict(game.published))
