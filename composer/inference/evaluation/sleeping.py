"""How long a behaviour sleeps, or runs a loop that only the clock ends."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.current_run import span_of
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.waiting import WAYS_OUT
from composer.inference.scopes import own_nodes
from composer.inference.values import Argument, Constant, External, PartOfNode, Place

if TYPE_CHECKING:
    from composer.inference.scopes import Scope
    from composer.python_source.syntax import FunctionNode

_CLOCKS = frozenset({'time.monotonic', 'time.perf_counter', 'time.time'})


class Sleeping(Part):
    """Notes what takes a time that the code shows."""

    def sleep(self, length: Argument, place: Place) -> None:
        """Note how long the behaviour sleeps."""
        run, seconds = self._evaluator.run, length.value
        if not isinstance(seconds, Constant) or seconds.kind not in (int, float):
            return
        if run.waits and run.is_sure and not seconds.is_chosen:
            sleep = float(seconds.value), span_of(place), span_of(length.place)
            run.reading.sleeps.append(sleep)

    def spin(self, node: ast.While, scope: Scope) -> None:
        """Note how long a loop goes on that only the clock ends."""
        if scope.function is None or any(isinstance(each, WAYS_OUT) for each in own_nodes(node)):
            return
        clock: ast.expr | None = None
        limit: ast.expr | None = None
        match node.test:
            case (
                ast.Compare(
                    left=ast.BinOp(left=now, op=ast.Sub()), ops=[ast.Lt() | ast.LtE()]
                ) as test
            ):
                clock, limit = now, test.comparators[0]
            case ast.Compare(left=now, ops=[ast.Lt() | ast.LtE()], comparators=[ast.Name(id=end)]):
                clock, limit = now, _limit_of(scope.function.definition, end, now)
        scale = self._scale_of(clock, scope) if clock is not None else None
        if scale is None or limit is None:
            return
        with self._evaluator.run.silence():
            seconds = self._evaluator.evaluate(limit, scope)
        if isinstance(seconds, Constant) and seconds.kind in (int, float):
            length = Constant(float, seconds.value * scale, seconds.is_chosen)
            where = Place(scope.module, limit)
            self.sleep(Argument(length, where), Place(scope.module, node.test))

    def _scale_of(self, clock: ast.expr, scope: Scope) -> float | None:
        """Return the unit of a clock in seconds; `None` if it is none."""
        if isinstance(clock, ast.Attribute) and clock.attr == 'nanoseconds':
            with self._evaluator.run.silence():
                is_time = self._evaluator.evaluate(clock.value, scope) == PartOfNode('time')
            return 1e-9 if is_time else None
        if isinstance(clock, ast.Call):
            with self._evaluator.run.silence():
                function = self._evaluator.evaluate(clock.func, scope)
            if isinstance(function, External) and function.name in _CLOCKS:
                return 1.0
        return None


def _limit_of(definition: FunctionNode | ast.Lambda, end: str, clock: ast.expr) -> ast.expr | None:
    """Return what is added to the clock where the end of a loop is set, once."""
    stored = [
        each
        for each in own_nodes(definition)
        if isinstance(each, ast.Name) and each.id == end and isinstance(each.ctx, ast.Store)
    ]
    for each in own_nodes(definition) if len(stored) == 1 else ():
        match each:
            case ast.Assign(
                targets=[ast.Name(id=name)], value=ast.BinOp(left=left, op=ast.Add(), right=right)
            ) if name == end and ast.dump(left) == ast.dump(clock):
                return right
    return None
