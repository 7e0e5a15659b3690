"""The system has no errors and works: it runs in virtual time, as fast as the computer can."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_it_has_no_errors():
    done = subprocess.run(
        [sys.executable, '-m', 'composer', 'check', '--strict', 'systems', 'test'],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_name_can_change_while_it_runs(composer):
    system = composer(ROOT / 'systems' / 'my_system.yaml', who='Alice')
    system.forward(1.5)
    assert [message.text for message in system.messages('/greeting')] == ['Hello Alice!']
    system.set_parameters('talker', {'who': 'Bob'})
    system.forward(1.0)
    assert system.messages('/greeting')[-1].text == 'Hello Bob!'
