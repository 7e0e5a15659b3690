"""Conditions of launch files → expressions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.launch_files.substitutions import Resolver, class_names, private, truth_of
from composer.launch_files.surroundings import Condition
from composer.launch_files.texts import Text

if TYPE_CHECKING:
    from composer.launch_files.place import Place


def read_condition(place: Place, condition: Any) -> Condition:
    """Return a condition of the launch file."""
    kinds = class_names(condition)
    if 'LaunchConfigurationEquals' in kinds:
        return _compared(place, condition, is_equal='LaunchConfigurationNotEquals' not in kinds)
    predicate = private(condition, 'predicate_expression')
    if predicate is None:
        context = place.loader.context
        return Condition('', place.resolve(kinds[0], lambda: bool(condition.evaluate(context))))
    value = Resolver(place).text(predicate)
    holds = truth_of(value)
    is_unless = 'UnlessCondition' in kinds
    if value.is_constant:
        return Condition('', holds != is_unless)
    code = value.condition()
    return Condition(f'not ({code})' if is_unless else code, holds != is_unless)


def _compared(place: Place, condition: Any, *, is_equal: bool) -> Condition:
    name = private(condition, 'launch_configuration_name')
    expected = private(condition, 'expected_value')
    value = place.scope.configurations.get(name)
    if not isinstance(value, Text) or expected is None:
        return Condition('', ((value is None) == (expected is None)) == is_equal)
    other = Resolver(place).text(expected)
    holds = (value.text == other.text) == is_equal
    if value.is_constant and other.is_constant:
        return Condition('', holds)
    return Condition(f'{value.code} {"==" if is_equal else "!="} {other.code}', holds)
