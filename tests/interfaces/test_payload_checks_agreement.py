"""What the check says of plain data is what the conversion does with it, on random data."""

from typing import Any

import pytest

pytest.importorskip('rclpy')

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.classes import import_interface
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_values import INTEGER_RANGES
from composer.interfaces.payload_checks import check_payload
from composer.runtime.messages.payloads import PayloadError, converter_for

pytestmark = pytest.mark.ros

CATALOGUE = InterfaceCatalogue()
# Data of any sort: what YAML can hold, wrong wherever it is put in.
ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=3),
    st.binary(max_size=2),
    st.just('a\0b'),
    st.just('\ud800'),
    st.just(10**400),
    st.integers(-300, 300),
    st.just(1e39),
    st.just([]),
    st.just({}),
    st.just({'data': 1}),
    st.dictionaries(st.one_of(st.text(max_size=2), st.integers()), st.none(), max_size=1),
    st.lists(st.one_of(st.integers(-1, 256), st.booleans(), st.floats()), max_size=4),
)


def messages(name: str, *, slips: bool) -> st.SearchStrategy[Any]:
    """Generate data for a message, with or without things that are wrong in it."""
    description = CATALOGUE.describe(name)
    assert isinstance(description, MessageDescription)
    fields = {field.name: values(field.type, slips=slips) for field in description.fields}
    mapping = st.fixed_dictionaries({}, optional=fields)
    # A mapping names the fields of the message itself, so it is never a bare value.
    bare = [
        value.filter(lambda data: not isinstance(data, dict))
        for value in fields.values()
        if len(fields) == 1
    ]
    if not slips:
        return st.one_of(mapping, *bare) if fields else st.sampled_from([{}, None])
    unknown = st.tuples(mapping, ANYTHING).map(lambda pair: {**pair[0], 'unknown': pair[1]})
    # Wrong data are rare at each place, so that there are right ones around them.
    return st.one_of(mapping, mapping, mapping, mapping, *bare, unknown, ANYTHING)


def values(field_type: FieldType, *, slips: bool) -> st.SearchStrategy[Any]:
    """Generate data for a field."""
    if field_type.array is None:
        right = scalars(field_type, slips=slips)
    else:
        bound = field_type.array_bound
        low = bound if bound is not None and field_type.array == 'fixed' else 0
        high = 3 if bound is None else bound
        items = scalars(field_type.item, slips=slips)
        right = st.lists(items, min_size=low, max_size=high)
        if slips:
            right = st.one_of(right, right, right, st.lists(items, max_size=high + 1))
    return st.one_of(right, right, right, right, ANYTHING) if slips else right


def scalars(field_type: FieldType, *, slips: bool) -> st.SearchStrategy[Any]:
    """Generate data for a single value."""
    if field_type.nested is not None:
        return messages(field_type.nested, slips=slips)
    if field_type.kind in INTEGER_RANGES:
        return st.integers(*INTEGER_RANGES[field_type.kind])
    if field_type.kind == 'bool':
        return st.booleans()
    if field_type.kind in {'float32', 'float64'}:
        width = int(field_type.kind[-2:])
        return st.one_of(st.floats(width=width), st.integers(-1000, 1000))  # type: ignore[arg-type]
    bound = field_type.string_bound
    letters = st.characters(codec='utf-8', exclude_characters='\0')
    return st.text(letters, max_size=5 if bound is None else bound // 4)


def conversion_problem(name: str, data: object) -> str | None:
    try:
        converter_for(import_interface(name)).convert(data)
    except PayloadError as error:
        return str(error)
    return None


NAMES = [
    'std_msgs/msg/String',
    'std_msgs/msg/ByteMultiArray',
    'shape_msgs/msg/SolidPrimitive',
    'test_msgs/msg/BasicTypes',
    'test_msgs/msg/Strings',
    'test_msgs/msg/Arrays',
    'test_msgs/msg/BoundedSequences',
]
QUICK = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.sampled
@pytest.mark.parametrize('name', NAMES)
def test_both_give_the_same_verdict_in_the_same_words(name: str) -> None:
    description = CATALOGUE.describe(name)
    assert isinstance(description, MessageDescription)
    verdicts = set()

    @QUICK
    @given(messages(name, slips=True))
    def agree(data: object) -> None:
        findings = list(check_payload(description, data, CATALOGUE))
        first = findings[0].message if findings else None
        assert conversion_problem(name, data) == first
        verdicts.add(first is None)

    agree()
    assert verdicts == {True, False}


@pytest.mark.sampled
@pytest.mark.parametrize('name', NAMES)
def test_right_data_pass_the_check_and_arrive(name: str) -> None:
    description = CATALOGUE.describe(name)
    assert isinstance(description, MessageDescription)
    message_class = import_interface(name)

    @QUICK
    @given(messages(name, slips=False))
    def arrive(data: object) -> None:
        assert list(check_payload(description, data, CATALOGUE)) == []
        message = converter_for(message_class).convert(data)
        once = deserialize_message(serialize_message(message), message_class)
        # Checking what was received changes nothing, and sending it on loses nothing. The text
        # of it is compared, since NaN is not equal to itself.
        assert repr(converter_for(message_class).convert(once)) == repr(once)
        assert repr(deserialize_message(serialize_message(once), message_class)) == repr(once)

    arrive()
