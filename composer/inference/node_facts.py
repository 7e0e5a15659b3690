"""What the file says of a node, for the reading of its behaviours."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.inference.values import (
    BY_FILE,
    BY_PARAMETER,
    BY_STATE,
    CHOSEN,
    UNKNOWN,
    Scalar,
    Unknown,
    Value,
    constant,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any

    from composer.language.specs import EndSpec, NodeSpec

Question = tuple[str, str]
_PYTHON_TYPES: dict[str, type] = {'bool': bool, 'integer': int, 'double': float, 'string': str}
# An array of numbers that a service sets is an `array.array`, which is much like a list.
_PYTHON_TYPES |= {f'{name}_array': list for name in _PYTHON_TYPES}


@dataclass(slots=True)
class NodeFacts:
    """Answers of one node, all of which are noted.

    For another node that gives the same ones, the reading of a behaviour is the same.

    Args:
        has_real_type: Whether the type of an entity is the one that is meant.
        kept: What behaviours keep in `node.state` and `node.own_state`, as far as that is known.
        tells_values: Whether it tells the node's name and the values of parameters, in which
            nodes differ most; else only what kind of value each is.

    Attributes:
        log: The questions that were asked, and their answers.
    """

    node: NodeSpec
    has_real_type: Callable[[EndSpec], bool]
    tells_values: bool = True
    kept: Mapping[str, Value] = field(default_factory=dict)
    log: dict[Question, object] = field(default_factory=dict)

    def type_of(self, section: str, name: str) -> str | None:
        """Return the type of an entity; `None` if there is none, or none that is known."""
        return self._ask(section, name)  # type: ignore[return-value]

    def value_of_parameter(self, name: str) -> Value:
        """Return what a parameter may be: the value that it starts with, or another one."""
        return self._ask('parameter', name)  # type: ignore[return-value]

    def kept_value(self, name: str) -> Value:
        """Return what behaviours keep under a name of the state; `[name]` is of `own_state`."""
        return self._ask('kept', name)  # type: ignore[return-value]

    def name(self) -> Value:
        """Return the name of the node."""
        return self._ask('name', '')  # type: ignore[return-value]

    def answers(self, questions: Iterable[Question]) -> tuple[object, ...]:
        """Return what this node answers."""
        return tuple(self._answer(*question) for question in questions)

    def _ask(self, topic: str, name: str) -> object:
        answer = self.log[topic, name] = self._answer(topic, name)
        return answer

    def _answer(self, topic: str, name: str) -> object:
        if topic == 'name':
            own = constant(self.node.name, is_chosen=BY_FILE)
            return own if self.tells_values else Scalar(str, BY_FILE)
        if topic == 'kept':
            return self.kept.get(name, Unknown(BY_STATE))
        if topic == 'parameter':
            return self._answer_parameter(name)
        entity: Any = getattr(self.node, topic).get(name)
        return entity.type if entity is not None and self.has_real_type(entity) else None

    def _answer_parameter(self, name: str) -> Value:
        parameter = self.node.parameters.get(name)
        if parameter is None:
            return UNKNOWN
        if isinstance(parameter.value, bool | int | float | str):
            value = constant(parameter.value, is_chosen=BY_PARAMETER)
            return value if self.tells_values else Scalar(value.kind, BY_PARAMETER)
        kind = _PYTHON_TYPES.get(parameter.type or '')
        is_set = parameter.value is not None or self.node.has_other_parameters
        unset = '' if is_set or self.node.parameter_files else name
        return Scalar(kind, is_chosen=BY_PARAMETER, unset=unset) if kind else CHOSEN
