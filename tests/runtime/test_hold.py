"""`composer up --hold FILE`: all nodes are there, and no behaviour runs while FILE is."""

import signal

import pytest

pytestmark = pytest.mark.ros

SYSTEM = """
    version: 1
    nodes:
      here: {on_start: parts:begin}
      there: {worker: apart, on_start: parts:begin}
    """
ALONE = SYSTEM.replace('worker: apart, ', '')
CODE = """
    def begin(node):
        node.logger.info('begins')
    """


@pytest.fixture
def hold(tmp_path):
    path = tmp_path / 'hold'
    path.touch()
    return path


def test_behaviours_start_when_the_file_is_gone(compose, hold, wait_for):
    child = compose(SYSTEM, CODE, '--hold', hold)
    wait_for(hold.read_text, 'the system to be held')
    assert hold.read_text() == f'{child.pid}\n'
    assert not child.matching('begins')
    hold.unlink()
    child.wait_until_ready()
    assert len(child.matching('begins')) == 2
    assert child.stop() == 0


def test_without_the_file_nothing_is_held(compose, hold):
    hold.unlink()
    child = compose(ALONE, CODE, '--hold', hold)
    child.wait_until_ready()
    assert child.stop() == 0
    assert not hold.exists()


def test_a_system_that_is_held_can_be_stopped(compose, hold, wait_for):
    child = compose(ALONE, CODE, '--hold', hold)
    wait_for(hold.read_text, 'the system to be held')
    assert child.stop(signal.SIGTERM, once_up=False) == 0
    assert not child.matching('begins')


def test_a_system_that_nobody_lets_go_ends(compose, hold, monkeypatch, tmp_path):
    (tmp_path / 'sitecustomize.py').write_text(
        'import composer.runtime.system as hold\nhold._LONGEST_HOLD_SEC = 0.3\n'
    )
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    child = compose(ALONE, CODE, '--hold', hold)
    assert child.wait() == 1
    assert child.matching(f'nobody has removed {hold} within 0.3 s')
    assert not hold.exists()
