"""Rows are evaluated, rendered and written, those that could not be measured too."""

import json

import pytest

pytest.importorskip('rclpy')

from benchmarks import run
from benchmarks.processes import MeasurementError
from benchmarks.report import Rounds, evaluate, render_table
from benchmarks.rows import ROWS, Job, Row, Side, alone, more, times, times_less

OURS, OTHER = Job('trips', 'composer', 5), Job('trips', 'single', 5)


def row(figure=times, sense='>=', target=2.0):
    return Row('trips', Side(OURS, 'rate'), Side(OTHER, 'rate'), figure, sense, target)


def rounds(*rates, errors=()):
    figures = [None if rate is None else {'rate': rate} for rate in rates]
    return Rounds(figures, list(errors))


def test_the_figure_is_the_median_of_the_ratios_of_rounds_in_turn():
    result = evaluate(row(), {OURS: rounds(10.0, 30.0, 90.0), OTHER: rounds(10.0, 10.0, 10.0)})
    assert (result.ours, result.other, result.figure) == (30.0, 10.0, 3.0)
    assert result.rounds == [(10.0, 10.0), (30.0, 10.0), (90.0, 10.0)]


@pytest.mark.parametrize(
    ('figure', 'expected'), [(times, 0.5), (times_less, 2.0), (more, -4.0), (alone, 4.0)]
)
def test_figures_relate_ours_to_the_other(figure, expected):
    result = evaluate(row(figure), {OURS: rounds(4.0), OTHER: rounds(8.0)})
    assert result.figure == expected


def test_a_target_is_reached_from_its_own_side():
    measured = {OURS: rounds(4.0), OTHER: rounds(2.0)}
    assert evaluate(row(sense='>=', target=2.0), measured).reached
    assert not evaluate(row(sense='>=', target=2.1), measured).reached
    assert evaluate(row(sense='<=', target=2.0), measured).reached
    assert not evaluate(row(sense='<=', target=1.9), measured).reached


def test_a_round_of_which_one_side_failed_does_not_count():
    measured = {OURS: rounds(4.0, 100.0), OTHER: rounds(2.0, None, errors=['single: late'])}
    assert evaluate(row(), measured).figure == 2.0


def test_the_table_says_what_was_reached_missed_and_not_measured():
    good = evaluate(row(), {OURS: rounds(12345.0), OTHER: rounds(5.0)})
    bad = evaluate(row(), {OURS: rounds(5.0), OTHER: rounds(5.0)})
    failed = evaluate(row(), {OURS: rounds(None, errors=['took too long']), OTHER: rounds(5.0)})
    assert render_table([good, bad, failed]).splitlines() == [
        'what       ours     other    figure  target',
        'trips    12,345      5.00     2,469  >= 2 ok',
        'trips      5.00      5.00      1.00  >= 2 MISSED',
        'trips                                >= 2 FAILED: took too long',
    ]


def test_a_run_measures_the_sides_in_turn_and_writes_what_each_round_gave(
    tmp_path, monkeypatch, capsys
):
    order = []

    def fake(job, seconds):
        order.append((job.side, seconds))
        return {'percent': 1.0 if job.side == 'composer' else 4.0}

    monkeypatch.setattr(run, 'run_job', fake)
    path = tmp_path / 'new' / 'bench.json'
    code = run.main(['--only', 'idle_cpu', '--rounds', '2', '--json', str(path)])
    assert code == 0
    assert order == [('composer', 5.0), ('rclpy', 5.0)] * 2
    report = json.loads(path.read_text())
    assert {'cpus', 'python', 'rclpy', 'rmw'} <= report['machine'].keys()
    (record,) = report['rows']
    assert record['rounds'] == [[1.0, 4.0], [1.0, 4.0]]
    assert record['reached'] is True
    assert '200 idle nodes, % of a core' in capsys.readouterr().out


def test_a_measurement_that_fails_is_a_row_and_the_others_go_on(tmp_path, monkeypatch, capsys):
    calls = []

    def fail(job, seconds):
        calls.append(job.subject)
        if job.subject == 'forty':
            message = 'took more than 60 s'
            raise MeasurementError(message)
        return {'percent': 1.0}

    monkeypatch.setattr(run, 'run_job', fail)
    path = tmp_path / 'bench.json'
    assert run.main(['--only', 'forty|idle_cpu', '--rounds', '3', '--json', str(path)]) == 1
    output = capsys.readouterr().out
    assert 'FAILED: forty composer 40: took more than 60 s' in output
    assert '<= 2 ok' in output
    assert calls.count('forty') == 2, 'what failed once is not tried again'


def test_a_pattern_that_matches_nothing_is_a_usage_error(capsys):
    assert run.main(['--only', 'no such row']) == 2


def test_every_row_asks_for_what_there_is_to_measure():
    from benchmarks.measure import SUBJECTS

    assert {job.subject for row in ROWS for job in row.jobs} == set(SUBJECTS)
    assert len({row.what for row in ROWS}) == len(ROWS)
