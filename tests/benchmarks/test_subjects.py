"""Every side of every subject can be measured, here at a tiny size."""

import pytest

pytest.importorskip('rclpy')

from benchmarks import processes
from benchmarks.processes import MeasurementError, run_job
from benchmarks.rows import ROWS, Job

pytestmark = pytest.mark.ros


@pytest.fixture(autouse=True)
def _own_domain(domain_id, monkeypatch):
    """Measure in a ROS domain that no other test takes meanwhile."""
    monkeypatch.setattr(processes, '_free_domain', lambda: domain_id)


TINY = {
    'check': 1,
    'forty': 2,
    'further_node': 1,
    'idle_cpu': 2,
    'large_messages': 1,
    'overhead': 1,
    'page': 2,
    'reloads': 5,
    'round_trips': 1,
    'save_to_callback': 3,
    'simulated': 2,
    'soak': 100,
    'start_stop': 2,
    'thousand': 2,
    'worker_hops': 100,
    'workers': 1,
}


def sides():
    """Return each side of each subject once, with the names of the figures that rows want."""
    wanted = {}
    for row in ROWS:
        for side in [row.ours, *([row.other] if row.other else [])]:
            wanted.setdefault((side.job.subject, side.job.side), set()).add(side.key)
    return wanted


@pytest.mark.long
@pytest.mark.parametrize(
    ('subject', 'side', 'keys'), [(*job, keys) for job, keys in sides().items()]
)
def test_a_side_is_measured(subject, side, keys):
    figures = run_job(Job(subject, side, TINY.get(subject, 0)), 0.3)
    assert keys <= figures.keys()


def test_a_measurement_that_cannot_be_says_why():
    with pytest.raises(MeasurementError, match="KeyError: 'no such executor'"):
        run_job(Job('round_trips', 'no such executor', 0), 0.1)
