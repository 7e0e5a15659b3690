"""Conditions over the fields of messages: `where`, `never` and `eventually`."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.limits import Budget
from composer.expressions.sandbox import Sandbox
from composer.scenarios.fields import MessageView, explain_error

if TYPE_CHECKING:
    from collections.abc import Iterable

# The name of the whole message in a condition.
MESSAGE = 'message'


class _NoBudget(Budget):
    """Counts no work: a case has thousands of messages, and runs behaviours of the same author."""

    def spend(self, *_values: Any) -> None:
        pass

    def spend_on_parsing(self, code: str) -> None:
        pass

    def collect(self, items: Iterable[Any]) -> list[Any]:
        return list(items)


class ConditionError(ComposerError):
    """A condition cannot be evaluated for a message."""


class Condition:
    """An expression over the fields of a message, and the message as `message`."""

    def __init__(self, code: str) -> None:
        self.code = code
        self._sandbox = Sandbox()
        self._sandbox.budget = _NoBudget()
        self._names: frozenset[str] | None = None

    def holds(self, message: Any) -> bool:
        """Return whether the condition holds for a message.

        Raises:
            ConditionError: The expression is wrong, or the message lacks what it asks for, as an
                item of an array that is too short.
        """
        try:
            if self._names is None:
                self._names = self._sandbox.names_in(self.code)
            view = MessageView(message)
            fields = message.get_fields_and_field_types()
            # A field that is called so, too, hides the message, as in the checks.
            scope: dict[str, Any] = {MESSAGE: view}
            scope |= {name: getattr(view, name) for name in self._names if name in fields}
            return bool(evaluate_expression(self._sandbox, self.code, scope))
        except Exception as error:
            raise ConditionError(explain_error(error)) from error


@lru_cache(maxsize=256)
def condition_of(code: str) -> Condition:
    """Return the condition of an expression; each is parsed once."""
    return Condition(code)
