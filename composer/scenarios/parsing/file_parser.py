"""Parses the file, its system, and its cases."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.scenarios.parsing.case_parts import parse_given, parse_schedule, parse_values
from composer.scenarios.parsing.expectation_parser import parse_expectation
from composer.scenarios.parsing.full_names import NameReader, absolute
from composer.scenarios.specs import (
    CallStepSpec,
    CaseSpec,
    GoalStepSpec,
    NodeStepSpec,
    PublishStepSpec,
    ScenarioSpec,
    SetParametersStepSpec,
    SystemReferenceSpec,
    TopicFaultStepSpec,
)
from composer.scenarios.times import to_nanoseconds
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import TypeVar

    from composer.language.specs import NodeSpec
    from composer.scenarios.specs import ExpectationSpec, StepSpec
    from composer.simulation.simulated_system import NodeAction
    from composer.simulation.topic_faults import TopicFaultKind
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath

    SpecT = TypeVar('SpecT')

DEFAULT_REAL_TIME_LIMIT_SEC = 60.0
# The lists of a case, whose items stand for themselves: what is wrong with one leaves the others.
_LISTS = ('when', 'then')
_DEPTH_OF_CASES = 2
_DEPTH_OF_ITEMS = 4
DEFAULT_TIMEOUT_SEC = 5.0


def parse_reference(
    data: Mapping[str, Any], paths: Mapping[DataPath, Path]
) -> SystemReferenceSpec:
    """Return what a file says of its system.

    Args:
        paths: The files that it names, by where they are named.
    """
    at: DataPath = ('system',)
    return SystemReferenceSpec(
        file=paths[(*at, 'file')],
        layers=tuple(path for where, path in paths.items() if 'layers' in where),
        words=tuple(
            f'{name}:={format_scalar(value)}' for name, value in data.get('args', {}).items()
        ),
        set_values=tuple(
            f'{path}={json.dumps(value)}' for path, value in data.get('set', {}).items()
        ),
        path=at,
    )


def parse_scenarios(
    document: Document,
    reference: SystemReferenceSpec,
    nodes: Mapping[str, NodeSpec],
    invalid: set[DataPath],
) -> ScenarioSpec:
    """Return the cases of a file, without those that are not valid.

    Args:
        nodes: Those of the system, by their keys.
        invalid: The paths of what is not valid.
    """
    parser = _FileParser(document, NameReader(nodes), invalid)
    data = document.data or {}
    cases = data['cases'] if isinstance(data.get('cases'), dict) else {}
    return ScenarioSpec(
        description=str(data.get('description', '')),
        system=reference,
        cases={name: parser.case(name) for name in cases if parser.is_case_valid(name)},
    )


class _FileParser:
    def __init__(self, document: Document, names: NameReader, invalid: set[DataPath]) -> None:
        self._document = document
        self._data: dict[str, Any] = document.data or {}
        self._names = names
        self._invalid = invalid
        self._folder = document.positions.source.folder

    def is_case_valid(self, name: str) -> bool:
        """Return whether a case can be parsed: nothing but items of its lists is wrong."""
        path = ('cases', name)
        wrong = [each for each in self._invalid if each[:_DEPTH_OF_CASES] == path]
        return all(len(each) >= _DEPTH_OF_ITEMS and each[2] in _LISTS for each in wrong)

    def case(self, name: str) -> CaseSpec:
        path: DataPath = ('cases', name)
        data = self._data['cases'][name]
        until = self._setting(data, 'until')
        return CaseSpec(
            name=name,
            description=str(data.get('description', '')),
            given=parse_given(
                data.get('given', {}), (*path, 'given'), self._names, self._recording
            ),
            steps=self._items(data, path, 'when', self._step),
            expectations=self._items(data, path, 'then', self._expectation),
            until_ns=self._missing_end(path) if until is None else to_nanoseconds(until),
            seed=int(self._setting(data, 'seed') or 0),
            real_time_limit_sec=float(
                self._setting(data, 'real_time_limit') or DEFAULT_REAL_TIME_LIMIT_SEC
            ),
            path=path,
        )

    def _setting(self, data: Mapping[str, Any], key: str) -> float | None:
        """Return a setting of a case, or that of the file."""
        if key in data:
            return float(data[key]) if key != 'seed' else data[key]
        return None if (key,) in self._invalid else self._data.get(key)

    def _items(
        self,
        data: Mapping[str, Any],
        path: DataPath,
        key: str,
        parse: Callable[[dict[str, Any], DataPath], SpecT],
    ) -> tuple[SpecT, ...]:
        found = []
        for index, item in enumerate(data.get(key, ())):
            at = (*path, key, index)
            if not any(each[:_DEPTH_OF_ITEMS] == at for each in self._invalid):
                found.append(parse(item, at))
        return tuple(found)

    def _step(self, data: dict[str, Any], path: DataPath) -> StepSpec:
        return parse_step(data, path, self._names)

    def _expectation(self, data: dict[str, Any], path: DataPath) -> ExpectationSpec:
        return parse_expectation(data, path, self._names, self._recording)

    def _recording(self, text: str) -> Path:
        return Path(os.path.normpath(self._folder / text))

    def _missing_end(self, path: DataPath) -> int:
        if ('until',) not in self._invalid:
            span = self._document.positions.key(path)
            message = f"the key 'until' is missing in case '{path[-1]}'"
            help_text = 'write when the case ends, in seconds since the start of the system'
            self._document.diagnostics.append(
                diagnostic_at(span, 'missing-key', message, help=help_text)
            )
        return 0


def parse_step(data: Mapping[str, Any], path: DataPath, names: NameReader) -> StepSpec:
    """Return a step."""
    if 'set_parameters' in data:
        return SetParametersStepSpec(
            schedule=parse_schedule(data),
            values=parse_values(data['set_parameters'], names),
            atomically=data.get('atomically', False),
            refused=data.get('refused', False),
            path=path,
        )
    verb = next(verb for verb in (*_VERBS, *_ACTIONS, *_FAULTS) if verb in data)
    if verb in _ACTIONS:
        return NodeStepSpec(parse_schedule(data), verb, data[verb], path)
    if verb in _FAULTS:
        return TopicFaultStepSpec(
            schedule=parse_schedule(data),
            kind=verb,
            topic=absolute(data[verb]),
            seconds=data.get('for'),
            delay_sec=float(data.get('by', 0)),
            path=path,
        )
    return _VERBS[verb](data, path)


def _parse_publish(data: Mapping[str, Any], path: DataPath) -> PublishStepSpec:
    return PublishStepSpec(
        schedule=parse_schedule(data),
        topic=absolute(data['publish']),
        message=data.get('message', {}),
        type=data.get('type'),
        path=path,
    )


def _parse_call(data: Mapping[str, Any], path: DataPath) -> CallStepSpec:
    return CallStepSpec(
        schedule=parse_schedule(data),
        service=absolute(data['call']),
        request=data.get('request', {}),
        response=data.get('response'),
        fails=data.get('fails', False),
        timeout_sec=float(data.get('timeout', DEFAULT_TIMEOUT_SEC)),
        tolerance=float(data.get('tolerance', 0)),
        type=data.get('type'),
        path=path,
    )


def _parse_goal(data: Mapping[str, Any], path: DataPath) -> GoalStepSpec:
    cancel_at = data.get('cancel_at')
    return GoalStepSpec(
        schedule=parse_schedule(data),
        action=absolute(data['send_goal']),
        goal=data.get('goal', {}),
        cancel_at_ns=None if cancel_at is None else to_nanoseconds(cancel_at),
        feedback=tuple(data['feedback']) if 'feedback' in data else None,
        result=data.get('result'),
        status=data.get('status', 'succeeded' if cancel_at is None else None),
        timeout_sec=float(data.get('timeout', DEFAULT_TIMEOUT_SEC)),
        tolerance=float(data.get('tolerance', 0)),
        type=data.get('type'),
        path=path,
    )


_ACTIONS: tuple[NodeAction, ...] = ('stop', 'kill', 'start', 'restart')


_FAULTS: tuple[TopicFaultKind, ...] = ('drop', 'delay', 'duplicate')


_VERBS: dict[str, Callable[[Mapping[str, Any], DataPath], StepSpec]] = {
    'publish': _parse_publish,
    'call': _parse_call,
    'send_goal': _parse_goal,
}
