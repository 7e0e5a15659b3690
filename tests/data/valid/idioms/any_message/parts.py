"""Functions for messages of any type, by the names of their fields."""


def measure(node):
    return {'voltage': 12.0}


def is_message(value):
    return hasattr(value, 'get_fields_and_field_types')


def walk(value):
    if is_message(value):
        for name in value.get_fields_and_field_types():
            walk(getattr(value, name))
    elif isinstance(value, list):
        for item in value:
            walk(item)


def walk_all(node, message):
    walk(message)
    if is_message(message.header):
        print(message.header.get_fields_and_field_types())


def change_all(node, message):
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if isinstance(value, bool):
            setattr(message, name, not value)
        elif isinstance(value, float):
            setattr(message, name, value + 1)
        elif is_message(value):
            for inner in value.get_fields_and_field_types():
                if isinstance(getattr(value, inner), str):
                    setattr(value, inner, 'map')
