import pytest

pytest.importorskip('rosidl_parser')

from rosidl_parser import definition as idl

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.class_fields import UnsupportedFieldError, describe_class
from composer.interfaces.classes import import_interface
from composer.interfaces.descriptions import (
    ActionDescription,
    FieldType,
    MessageDescription,
    ServiceDescription,
)

pytestmark = pytest.mark.ros


def fields_of(description: MessageDescription) -> list[tuple[str, FieldType]]:
    return [(field.name, field.type) for field in description.fields]


@pytest.mark.parametrize('package', ['std_msgs', 'geometry_msgs', 'sensor_msgs', 'test_msgs'])
def test_a_class_says_the_same_of_itself_as_its_installed_description(package: str) -> None:
    catalogue = InterfaceCatalogue()
    for name in catalogue.names('msg', package):
        installed = catalogue.describe(name)
        assert isinstance(installed, MessageDescription)
        own = describe_class(import_interface(name))
        assert own.name == name
        assert fields_of(own) == fields_of(installed)


def test_the_parts_of_services_and_actions_are_described_like_messages() -> None:
    catalogue = InterfaceCatalogue()
    ask = catalogue.describe('test_msgs/srv/BasicTypes')
    go = catalogue.describe('test_msgs/action/NestedMessage')
    assert isinstance(ask, ServiceDescription)
    assert isinstance(go, ActionDescription)
    service = import_interface(ask.name)
    action = import_interface(go.name)
    for described, own in [
        (ask.request, service.Request),  # type: ignore[attr-defined]
        (ask.response, service.Response),  # type: ignore[attr-defined]
        (go.goal, action.Goal),  # type: ignore[attr-defined]
        (go.feedback, action.Feedback),  # type: ignore[attr-defined]
        (go.result, action.Result),  # type: ignore[attr-defined]
    ]:
        assert describe_class(own).name == described.name
        assert fields_of(describe_class(own)) == fields_of(described)


def generated(slot: idl.AbstractType) -> type:
    return type(
        'Odd',
        (),
        {
            '__module__': 'my_msgs.msg._odd',
            'SLOT_TYPES': (slot,),
            'get_fields_and_field_types': classmethod(lambda _: {'data': 'anything'}),
        },
    )


@pytest.mark.parametrize(
    ('slot', 'text'),
    [
        (idl.BoundedWString(maximum_size=7), 'wstring<=7'),
        (idl.BoundedSequence(idl.BoundedString(maximum_size=10), 3), 'string<=10[<=3]'),
        (idl.Array(idl.NamespacedType(['a_msgs', 'msg'], 'B'), 2), 'a_msgs/msg/B[2]'),
    ],
)
def test_bounds_within_arrays_are_kept(slot: idl.AbstractType, text: str) -> None:
    (field,) = describe_class(generated(slot)).fields
    assert (field.name, str(field.type)) == ('data', text)


@pytest.mark.parametrize('name', ['char', 'wchar', 'long double'])
def test_a_type_that_only_idl_has_is_named(name: str) -> None:
    with pytest.raises(UnsupportedFieldError) as caught:
        describe_class(generated(idl.UnboundedSequence(idl.BasicType(name))))
    assert str(caught.value) == (
        f'my_msgs/msg/Odd.data is of the IDL type {name!r}, which .msg files do not have'
    )
