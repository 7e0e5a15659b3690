"""Parses the expectations of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.parsing.case_parts import parse_values, parse_window
from composer.scenarios.parsing.full_names import absolute
from composer.scenarios.specs import (
    ErrorExpectationSpec,
    ExitExpectationSpec,
    LikeExpectationSpec,
    LogExpectationSpec,
    MessageExpectationSpec,
    OrderExpectationSpec,
    ParametersExpectationSpec,
    PatternSpec,
    RateExpectationSpec,
    StateExpectationSpec,
)
from composer.scenarios.times import to_nanoseconds

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from composer.scenarios.parsing.full_names import NameReader
    from composer.scenarios.specs import ExpectationSpec
    from composer.yaml_text.positions import DataPath

ANY_NODE = '*'


def parse_expectation(
    data: Mapping[str, Any],
    path: DataPath,
    names: NameReader,
    find_recording: Callable[[str], Path],
) -> ExpectationSpec:
    """Return an expectation."""
    if 'like' in data:
        return LikeExpectationSpec(
            topic=absolute(data['topic']),
            recording=find_recording(data['like']),
            tolerance=float(data.get('tolerance', 0)),
            ignored=tuple(data.get('ignore', ())),
            path=path,
        )
    key = next(key for key in _PARSERS if key in data)
    return _PARSERS[key](data, path, names)


def _parse_messages(
    data: Mapping[str, Any], path: DataPath, _: NameReader
) -> MessageExpectationSpec:
    least, most = _parse_count(data)
    return MessageExpectationSpec(
        pattern=_parse_pattern(data, path),
        window=parse_window(data),
        least=least,
        most=most,
        path=path,
    )


def _parse_rate(data: Mapping[str, Any], path: DataPath, _: NameReader) -> RateExpectationSpec:
    lowest, highest = data['rate']
    return RateExpectationSpec(
        pattern=_parse_pattern(data, path),
        window=parse_window(data, 'between'),
        lowest=lowest,
        highest=highest,
        path=path,
    )


def _parse_order(data: Mapping[str, Any], path: DataPath, _: NameReader) -> OrderExpectationSpec:
    patterns = (
        _parse_pattern({'tolerance': data.get('tolerance', 0), **item}, (*path, 'order', index))
        for index, item in enumerate(data['order'])
    )
    return OrderExpectationSpec(tuple(patterns), parse_window(data), path)


def _parse_pattern(data: Mapping[str, Any], path: DataPath) -> PatternSpec:
    """Return which messages are meant; `never` and `eventually` may hold the expression."""
    key = next((key for key in ('never', 'eventually') if isinstance(data.get(key), str)), 'where')
    condition = data.get(key)
    if key == 'never' and 'where' in data:
        condition = f'({data["where"]}) and ({condition})'
    return PatternSpec(
        topic=absolute(data['topic']),
        where=condition,
        message=data.get('message'),
        tolerance=float(data.get('tolerance', 0)),
        where_path=(*path, key),
        message_path=(*path, 'message'),
        path=path,
    )


def _parse_count(data: Mapping[str, Any]) -> tuple[int, int | None]:
    if 'never' in data:
        return 0, 0
    if 'count' not in data:
        return 1, None
    count = data['count']
    least, most = count if isinstance(count, list) else (count, count)
    return int(least), int(most)


def _parse_log(data: Mapping[str, Any], path: DataPath, names: NameReader) -> LogExpectationSpec:
    least, most = _parse_count(data)
    return LogExpectationSpec(
        node=_parse_node(data['log'], names),
        level=data.get('level'),
        text=data.get('text'),
        regex=data.get('matches'),
        window=parse_window(data),
        least=least,
        most=most,
        path=path,
    )


def _parse_error(
    data: Mapping[str, Any], path: DataPath, names: NameReader
) -> ErrorExpectationSpec:
    least, most = _parse_count(data)
    return ErrorExpectationSpec(
        node=_parse_node(data['error'], names),
        text=data.get('text'),
        regex=data.get('matches'),
        window=parse_window(data),
        least=least,
        most=most,
        path=path,
    )


def _parse_node(name: str, names: NameReader) -> str | None:
    return None if name == ANY_NODE else names.node(name)


def _parse_parameters(
    data: Mapping[str, Any], path: DataPath, names: NameReader
) -> ParametersExpectationSpec:
    return ParametersExpectationSpec(
        values=parse_values(data['parameters'], names),
        at_ns=_parse_moment(data),
        window=parse_window(data) if 'within' in data else None,
        tolerance=float(data.get('tolerance', 0)),
        path=path,
    )


def _parse_state(
    data: Mapping[str, Any], path: DataPath, names: NameReader
) -> StateExpectationSpec:
    return StateExpectationSpec(
        states={names.node(node): state for node, state in data['state'].items()},
        at_ns=_parse_moment(data),
        window=parse_window(data) if 'within' in data else None,
        path=path,
    )


def _parse_moment(data: Mapping[str, Any]) -> int | None:
    return to_nanoseconds(data['at']) if 'at' in data else None


def _parse_exit(data: Mapping[str, Any], path: DataPath, _: NameReader) -> ExitExpectationSpec:
    return ExitExpectationSpec(int(data['exit_code']), parse_window(data), path)


# `rate` stands beside `topic`, and comes first.
_PARSERS: dict[str, Callable[[Mapping[str, Any], DataPath, NameReader], ExpectationSpec]] = {
    'rate': _parse_rate,
    'topic': _parse_messages,
    'order': _parse_order,
    'log': _parse_log,
    'error': _parse_error,
    'parameters': _parse_parameters,
    'state': _parse_state,
    'exit_code': _parse_exit,
}
