"""The health of entities: the numbers, and the diagnostic status made of them."""

import random
import threading

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.validate_node_name import validate_node_name

from composer.runtime.behaviours.calls import BehaviourCall
from composer.runtime.behaviours.running_calls import Owner, RunningCalls
from composer.runtime.control.protocol import node_name
from composer.runtime.health.diagnostic_status import StatusWriter
from composer.runtime.health.missed import MissedCounts
from composer.runtime.health.statistics import CallTimes, EntityHealth, HealthRegistry


def times_of(durations):
    times = CallTimes()
    for duration in durations:
        times.add(duration)
    return times


DISTRIBUTIONS = {
    'constant': lambda chance: 1_000_000,
    'log-normal': lambda chance: int(chance.lognormvariate(11.0, 2.0)),
    'two peaks': lambda chance: 20_000 if chance.random() < 0.97 else 80_000_000,
}


@pytest.mark.parametrize('name', DISTRIBUTIONS)
def test_percentiles_are_at_most_a_bucket_too_high(name):
    chance = random.Random(7)
    durations = sorted(DISTRIBUTIONS[name](chance) for _ in range(5000))
    for share in (0.5, 0.99, 1.0):
        exact = durations[max(0, int(len(durations) * share) - 1)]
        found = times_of(durations).percentile_ns(share)
        assert exact <= found <= exact * 9 / 8 + 256, share


def test_the_mean_and_the_maximum_are_exact():
    times = times_of([100, 200, 3_000_000, 5])
    assert (times.calls(), times.mean_ns(), times.most_ns) == (4, 3_000_305 / 4, 3_000_000)


def test_calls_of_several_threads_are_all_counted():
    times = CallTimes()
    taken = []
    threads = [
        threading.Thread(target=lambda: [times.add(n) for n in range(20_000)]) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        taken.append(times.take())
    taken.append(times.take())
    assert sum(one.calls() for one in taken) == 80_000
    assert sum(one.total_ns for one in taken) == 4 * sum(range(20_000))


def test_a_report_tells_the_period_and_the_whole():
    health = EntityHealth()
    missed = MissedCounts(overruns=3)
    health.follow(lambda: missed)
    health.times.add(1000)
    health.note_error(ValueError('boom'))
    first = health.report(1.0, 0.0)
    assert (first.times.calls(), first.errors, first.last_error) == (1, 1, 'ValueError: boom')
    assert (first.missed, first.all_missed) == (missed, missed)
    health.times.add(1000)
    second = health.report(2.0, 7.0)
    assert (second.times.calls(), second.errors, second.last_error) == (1, 0, '')
    assert (second.all_calls, second.all_errors) == (2, 1)
    assert (second.missed, second.all_missed) == (MissedCounts(), missed)
    assert (second.period_sec, second.overdue_sec) == (2.0, 7.0)


def test_what_is_missed_at_rest_does_not_count():
    health, counts = EntityHealth(), [3]
    health.follow(lambda: MissedCounts(overruns=counts[-1]))
    heard = []
    for rests, count in ((True, 5), (True, 9), (False, 9), (False, 11), (True, 12), (False, 20)):
        health.rest(rests=rests)
        counts.append(count)
        report = health.report(1.0, 0.0)
        heard.append((report.missed.overruns, report.all_missed.overruns))
    assert heard == [(3, 3), (0, 3), (0, 3), (2, 5), (0, 5), (8, 13)]


def test_a_huge_error_that_ros_cannot_say_is_made_short_and_sayable():
    health = EntityHealth()
    health.note_error(ValueError('\udcff' * 3_000_000))
    last_error = health.report(1.0, 0.0).last_error
    assert len(last_error) < 5_000
    assert last_error.encode()


def test_counts_survive_that_the_node_is_built_anew():
    board = HealthRegistry()
    old = board.entity('/a', Owner('timer', 'b'))
    counts = [MissedCounts(late_ticks=2)]
    old.follow(lambda: counts[-1])
    old.report(1.0, 0.0)
    counts.append(MissedCounts())  # Its timer has been destroyed.
    assert old.report(1.0, 0.0).all_missed == MissedCounts(late_ticks=2)
    new = board.entity('/a', Owner('timer', 'b'))
    new.follow(lambda: MissedCounts(late_ticks=1, skipped_ticks=4))
    report = new.report(1.0, 0.0)
    assert report.all_missed == MissedCounts(late_ticks=3, skipped_ticks=4)
    assert report.missed == MissedCounts(late_ticks=1, skipped_ticks=4)


def measured_call(function, times, failed=lambda owner, error: None):
    return BehaviourCall(
        'it', function, RunningCalls(), deliver=lambda _: None, failed=failed, add_time=times.add
    )


def test_coroutines_are_measured_to_their_end():
    times = CallTimes()

    class Pause:
        def __await__(self):
            yield

    async def behaviour():
        await Pause()

    coroutine = measured_call(behaviour, times).run()
    coroutine.send(None)
    assert times.calls() == 0
    with pytest.raises(StopIteration):
        coroutine.send(None)
    assert times.calls() == 1


@pytest.mark.parametrize('system', ['fleet.of-two rovers', 'größe', '2', 'x' * 300])
def test_every_system_has_a_node_with_a_valid_name(system):
    assert validate_node_name(node_name(system))
    assert node_name('fleet.of-two rovers') == '_composer_fleet_of_two_rovers'


def status_of(owner, durations=(), errors=(), missed=None, overdue_sec=0.0):
    health = EntityHealth()
    health.follow(lambda: missed or MissedCounts())
    for duration in durations:
        health.times.add(duration)
    for error in errors:
        health.note_error(error)
    return StatusWriter('/ns/talker', owner, 'robot').write(health.report(2.0, overdue_sec))


def test_a_status_is_named_as_diagnostic_tools_expect_it():
    status = status_of(Owner('timer', 'tick'), [1_000_000] * 5)
    assert (status.name, status.hardware_id) == ('/ns/talker: timer tick', 'robot')
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'called')
    assert {pair.key: pair.value for pair in status.values} == {
        'calls': '5',
        'errors': '0',
        'rate (Hz)': '2.50',
        'callback time mean (ms)': '1.0000',
        'callback time p99 (ms)': '1.0000',
        'callback time max (ms)': '1.0000',
        'late ticks': '0',
        'skipped ticks': '0',
    }


@pytest.mark.parametrize(
    ('owner', 'arguments', 'level', 'message'),
    [
        (Owner('timer', 'a'), {}, DiagnosticStatus.OK, 'not called'),
        (
            Owner('timer', 'a'),
            {'missed': MissedCounts(late_ticks=2)},
            DiagnosticStatus.OK,
            'not called',
        ),
        (
            Owner('timer', 'a'),
            {'missed': MissedCounts(late_ticks=1, skipped_ticks=3)},
            DiagnosticStatus.WARN,
            '1 late tick; 3 skipped ticks',
        ),
        (
            Owner('subscription', 'a'),
            {'missed': MissedCounts(overruns=2)},
            DiagnosticStatus.WARN,
            '2 messages dropped from the full queue',
        ),
        (
            Owner('service', 'a'),
            {'overdue_sec': 12.34},
            DiagnosticStatus.WARN,
            'a call has been running for 12.3 s',
        ),
        (
            Owner('timer', 'a'),
            {'errors': [KeyError('x'), ValueError('boom')], 'missed': MissedCounts(late_ticks=2)},
            DiagnosticStatus.ERROR,
            '2 errors, last: ValueError: boom; 2 late ticks',
        ),
    ],
)
def test_the_level_and_the_message_tell_what_is_wrong(owner, arguments, level, message):
    status = status_of(owner, **arguments)
    assert (status.level, status.message) == (level, message)
