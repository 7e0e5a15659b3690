"""The fixtures of the tests of the executor."""

import pytest


@pytest.fixture
def patient(monkeypatch):
    """Let `spin_once` wait for the end of its callback, however long the machine keeps it."""
    from spinning import DEADLINE_SEC

    monkeypatch.setattr('composer.executor.spinner.GRACE_SEC', DEADLINE_SEC)
