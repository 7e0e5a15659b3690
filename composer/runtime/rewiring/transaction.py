"""Changes of a running system that are all made, or all undone."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable


class Transaction:
    """What is done when all changes were made, and what if one of them failed."""

    def __init__(self) -> None:
        self._undo: list[Callable[[], object]] = []
        self._replace: list[Callable[[], object]] = []
        self._finish: list[Callable[[], object]] = []

    def on_undo(self, function: Callable[..., object], *arguments: Any, **keywords: Any) -> None:
        """Have a change undone by this call, before those that were made earlier."""
        self._undo.append(partial(function, *arguments, **keywords))

    def on_replace(self, function: Callable[..., object], *arguments: Any) -> None:
        """Have this called when all changes were made, before behaviours go on."""
        self._replace.append(partial(function, *arguments))

    def on_commit(self, function: Callable[..., object], *arguments: Any) -> None:
        """Have this called when all changes were made."""
        self._finish.append(partial(function, *arguments))

    def undo(self) -> None:
        """Undo the changes, the last one first, as far as that can be."""
        for undo in reversed(self._undo):
            try:
                undo()
            except Exception as error:  # noqa: BLE001 - the rest must be undone
                system_logger.error(f'reload: something could not be undone: {error}')

    def replace(self) -> None:
        """Let go of what has a successor."""
        for replace in self._replace:
            replace()

    def commit(self) -> None:
        """Do what comes last."""
        for finish in self._finish:
            finish()
