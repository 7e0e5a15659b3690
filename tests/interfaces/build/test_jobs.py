import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from composer.interfaces.build.jobs import Job, JobError, run_jobs


def python(code: str, *arguments: str) -> Callable[[], Sequence[str]]:
    return lambda: [sys.executable, '-c', code, *arguments]


APPEND = 'import sys; open("log", "a").write(sys.argv[1])'


def test_jobs_run_after_those_that_they_wait_for(tmp_path: Path) -> None:
    run_jobs(
        [
            Job('c', python(APPEND, 'c'), tmp_path, ('b',)),
            Job('b', python(APPEND, 'b'), tmp_path, ('a',)),
            Job('a', python(APPEND, 'a'), tmp_path),
        ],
        workers=3,
        environment=os.environ,
    )
    assert (tmp_path / 'log').read_text() == 'abc'


def test_a_command_is_made_when_its_job_starts(tmp_path: Path) -> None:
    def list_files() -> list[str]:
        names = sorted(path.name for path in tmp_path.iterdir())
        return [sys.executable, '-c', APPEND, str(names)]

    run_jobs(
        [
            Job('list', list_files, tmp_path, ('make',)),
            Job('make', python('open("made", "w")'), tmp_path),
        ],
        workers=2,
        environment=os.environ,
    )
    assert (tmp_path / 'log').read_text() == "['made']"


def test_two_jobs_run_at_the_same_time(tmp_path: Path) -> None:
    meet = (
        'import os, sys, time\n'
        'mine, other = sys.argv[1:]\n'
        'open(mine, "w").close()\n'
        'end = time.monotonic() + 60\n'
        'while not os.path.exists(other):\n'
        '    assert time.monotonic() < end\n'
        '    time.sleep(0.01)\n'
    )
    run_jobs(
        [
            Job('a', python(meet, 'a', 'b'), tmp_path),
            Job('b', python(meet, 'b', 'a'), tmp_path),
        ],
        workers=2,
        environment=os.environ,
    )


def test_a_failure_ends_the_other_jobs_and_carries_the_output(tmp_path: Path) -> None:
    with pytest.raises(JobError) as caught:
        run_jobs(
            [
                Job('endless', python('import time; time.sleep(600)'), tmp_path),
                Job('wrong', python('import sys; print("out"); sys.exit("err")'), tmp_path),
                Job('later', python(APPEND, 'x'), tmp_path, ('wrong',)),
            ],
            workers=2,
            environment=os.environ,
        )
    assert caught.value.job == 'wrong'
    assert sorted(caught.value.output.split()) == ['err', 'out']
    assert not (tmp_path / 'log').exists()


def test_programs_inherit_the_given_descriptors(tmp_path: Path) -> None:
    read_end, write_end = os.pipe()
    try:
        code = f'import os; os.write({write_end}, b"hello")'
        run_jobs(
            [Job('write', python(code), tmp_path)],
            workers=1,
            environment=os.environ,
            descriptors=[write_end],
        )
        assert os.read(read_end, 10) == b'hello'
    finally:
        os.close(read_end)
        os.close(write_end)
