"""After any edits, a running system equals a fresh start of its files; all else was untouched.

`python -m tests.runtime.rewiring.test_random_edits SEED COUNT` plays on, and prints each edit.
"""

import os
import sys
import tempfile
import threading
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from tests.runtime.rewiring.edit_values import LEFT_OUT, LEFT_OUT_WHOLLY, VALUES
from tests.runtime.rewiring.edits import Project
from tests.runtime.rewiring.game import playing
from tests.runtime.rewiring.schema_keys import read_schema_keys

pytestmark = pytest.mark.ros


@pytest.mark.long
def test_edits(tmp_path, domain_id, other_domain_id):
    with playing(tmp_path, 2, (domain_id, other_domain_id)) as game:
        for _ in range(8):
            game.play()
    assert game.applied > 2


def test_each_key_of_the_schema_is_edited(tmp_path):
    keys = {key for key in read_schema_keys() if key.partition('.')[0] not in LEFT_OUT_WHOLLY}
    assert keys == VALUES.keys() | LEFT_OUT.keys()
    project = Project(tmp_path, 1)
    project.keep()
    for number in range(4000):
        project.edit()
        if number % 5 == 0:
            project.go_back()
    assert project.edited == VALUES.keys()


if __name__ == '__main__':
    seed, count = sys.argv[1:]
    domain = int(os.environ['ROS_DOMAIN_ID'])
    with tempfile.TemporaryDirectory() as folder:
        with playing(Path(folder), int(seed), (domain, domain + 1), 1.0) as game:
            for number in range(int(count)):
                print(number, *game.play(), flush=True)
        print('applied', game.applied, threading.enumerate())
