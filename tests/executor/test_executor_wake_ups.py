"""No wake-up of the executor's leader gets lost."""

import pytest

pytest.importorskip('rclpy')

from rclpy.context import Context

from composer.executor import ComposerExecutor

pytestmark = pytest.mark.ros

A_THREAD_THAT_WAITS = -1


@pytest.fixture
def engine(domain_id):
    context = Context()
    context.init(domain_id=domain_id)
    executor = ComposerExecutor(context=context)
    yield executor._engine
    executor.shutdown()
    context.try_shutdown()
    context.destroy()


def test_who_looks_in_passing_leaves_a_wake_up_to_those_who_wait(engine):
    engine.polling._pollers.add(A_THREAD_THAT_WAITS)
    engine.polling.wake()
    assert engine.polling.peek()
    assert engine.polling.board.peek(), 'the leader would sleep on'
    engine.polling._pollers.clear()


def test_who_looks_while_nobody_waits_uses_the_wake_up_up(engine):
    engine.polling.board.wake()
    assert engine.polling.peek()
    assert not engine.polling.board.peek(), 'the leader would never sleep'
