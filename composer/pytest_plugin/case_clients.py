"""The process that runs the cases of a run of pytest; the first case starts it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from composer.scenarios.running.case_client import CaseClient

_client = pytest.StashKey['CaseClient']()


def find_client(config: pytest.Config) -> CaseClient:
    """Return what runs cases; it is the same for all of them."""
    from composer.scenarios.running.case_client import CaseClient

    if _client not in config.stash:
        config.stash[_client] = CaseClient(folder=config.invocation_params.dir)
    return config.stash[_client]


def end_client(config: pytest.Config) -> None:
    """End the process, if there is one."""
    if _client in config.stash:
        config.stash[_client].close()
        del config.stash[_client]
