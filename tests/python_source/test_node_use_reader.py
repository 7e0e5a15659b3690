"""What a function does with its node, told by its text."""

import ast

import pytest

from composer.python_source.local_names import find_parameter
from composer.python_source.node_use_reader import read_node_uses
from composer.python_source.node_uses import USED_NOUNS


def read(body, head='def f(node, message, mode=1):', given=('node', 'message')):
    lines = '\n'.join(f'    {line}' for line in body.splitlines())
    (function,) = ast.parse(f'{head}\n{lines}').body
    return read_node_uses(function, 'node', given)


@pytest.mark.parametrize(
    ('body', 'kind', 'name'),
    [
        ("node.publish('x', 1)", 'publisher', 'x'),
        ("node.publish(name='x', payload=1)", 'publisher', 'x'),
        ("node.call('x')", 'service client', 'x'),
        ("return node.call('x', message).sum", 'service client', 'x'),
        ("node.send_goal('x', {})", 'action client', 'x'),
        ('print(node.parameters.x)', 'parameter', 'x'),
        ("print(node.parameters['x'])", 'parameter', 'x'),
        ("print(node.parameters.get('x'))", 'parameter', 'x'),
        ("'x' in node.parameters", 'parameter', 'x'),
        ("for item in message.items:\n    node.publish('x', item)", 'publisher', 'x'),
        ("send = lambda: node.publish('x', 1)", 'publisher', 'x'),
        ("with open('f') as file:\n    node.publish('x', file.read())", 'publisher', 'x'),
    ],
)
def test_a_literal_name_is_a_use(body, kind, name):
    found = read(body)
    assert [(use.kind, use.name) for use in found.uses] == [(kind, name)]
    assert found.open_kinds == set()


def test_a_name_has_its_place_in_the_text():
    body = "node.publish('x', node.parameters.speed)"
    places = {(use.name, use.line, use.column) for use in read(body).uses}
    assert places == {('x', 2, 19), ('speed', 2, 39)}


@pytest.mark.parametrize(
    'body',
    [
        'node.logger.info(node.name)',
        'node.state.count += 1',
        'node.shutdown(node.now().nanoseconds)',
        "node.set_parameters('other', {'a': 1})",
        'pass',
    ],
)
def test_what_reaches_nothing_declared_is_no_use(body):
    found = read(body)
    assert (found.uses, found.open_kinds) == ((), set())


@pytest.mark.parametrize(
    ('body', 'kinds'),
    [
        ('node.publish(message.name, 1)', {'publisher'}),
        ("node.publish(f'{mode}', 1)", {'publisher'}),
        ('node.publish(*message)', {'publisher'}),
        ('node.publish(**message)', {'publisher'}),
        ('send = node.call', {'service client'}),
        ('node.parameters[mode]', {'parameter'}),
        ('dict(node.parameters)', {'parameter'}),
        ('node.parameters.items()', {'parameter'}),
        ('getattr(node.parameters, mode)', {'parameter'}),
        ('node.ros.get_parameter(mode)', {'parameter'}),
        ('self = node', USED_NOUNS),
        ('return node', USED_NOUNS),
        ('message.tell(node)', USED_NOUNS),
        ('print(node)', USED_NOUNS),
        ("getattr(node, 'publish')('x', 1)", USED_NOUNS),
        ("node = message\nnode.publish('x', 1)", USED_NOUNS),
        ("for node in message: node.publish('x', 1)", USED_NOUNS),
        ('[node.publish for node in message]', USED_NOUNS),
        ('def tell(n): ...\ntell(node)', USED_NOUNS),
        ('tell = message\ntell(node)', USED_NOUNS),
        ('tell(*message, node)', USED_NOUNS),
        ('tell(**{"node": node})', USED_NOUNS),
    ],
)
def test_what_cannot_be_told_is_open(body, kinds):
    assert read(body).open_kinds == kinds


def test_a_name_of_a_function_inside_that_means_another_node_is_no_use():
    assert read("def tell(node):\n    node.publish('x', 1)").uses == ()


def test_a_helper_takes_the_node_on():
    (first, second) = read('tell(node, 1)\nreturn tell(1, to=node)').passes
    assert (first.function, first.position, first.waits) == ('tell', 0, True)
    assert second.position == 'to'


CERTAIN = "node.publish('x', 1)"


@pytest.mark.parametrize(
    ('body', 'is_certain'),
    [
        (CERTAIN, True),
        (f'if message.data > 3: {CERTAIN}', True),
        (f'if message.data > LIMIT:\n    return\n{CERTAIN}', True),
        (f'while True: {CERTAIN}', True),
        (f'for _ in range(3): {CERTAIN}', True),
        (f'if node.state.count > 3: {CERTAIN}', True),
        (f'if mode: {CERTAIN}', False),
        (f'if mode: pass\nelse: {CERTAIN}', False),
        (f'if mode: return\n{CERTAIN}', False),
        (f'if mode: print(1)\n{CERTAIN}', True),
        (f'if not mode: raise ValueError\n{CERTAIN}', False),
        (f'fast = mode == 2\nif fast: {CERTAIN}', False),
        (f'if node.name == "a": {CERTAIN}', False),
        (f'if node.parameters.debug: {CERTAIN}', False),
        (f'if DEBUG: {CERTAIN}', False),
        (f'if False: {CERTAIN}', False),
        (f'mode and {CERTAIN}', False),
        (f'{CERTAIN} if mode else None', False),
        (f'match mode:\n    case 1: {CERTAIN}', False),
        (f'for _ in range(mode): {CERTAIN}', False),
        (f'assert mode\n{CERTAIN}', False),
    ],
)
def test_what_a_file_decides_makes_a_use_uncertain(body, is_certain):
    uses = [use for use in read(body).uses if use.kind == 'publisher']
    assert [use.is_certain for use in uses] == [is_certain]


@pytest.mark.parametrize(
    ('handler', 'is_guarded'),
    [
        ('except KeyError: pass', True),
        ('except (ValueError, composer.UndeclaredError): pass', True),
        ('except Exception: pass', True),
        ('except: pass', True),
        ('except find(): pass', True),
        ('except ServiceNotAvailableError: pass', False),
        ('finally: pass', False),
    ],
)
def test_an_error_that_is_caught_guards_a_use(handler, is_guarded):
    (use,) = read(f'try:\n    {CERTAIN}\n{handler}').uses
    assert use.is_guarded == is_guarded


def test_suppress_guards_a_use():
    assert read(f'with suppress(KeyError): {CERTAIN}').uses[0].is_guarded


def test_get_copes_without_a_parameter():
    plain, with_default = read("node.parameters.get('x')\nnode.parameters.get('y', 2)").uses
    assert (plain.is_optional, plain.has_default) == (True, False)
    assert (with_default.is_optional, with_default.has_default) == (True, True)


@pytest.mark.parametrize(
    ('body', 'waits'),
    [
        ("node.call('x')", True),
        ("await node.call_async('x')", True),
        ("return (await node.call_async('x')).sum", True),
        ("node.call_async('x')", False),
        ("spawn(node.call_async('x'))", False),
        ("spawn(lambda: node.call('x'))", False),
        ("def ask():\n    node.call('x')\nspawn(ask)", False),
    ],
)
def test_who_calls_and_stays_waits(body, waits):
    (use,) = read(body, head='async def f(node, message):').uses
    assert use.waits == waits


def test_reading_parameters_of_other_nodes_is_noted():
    assert read("node.get_parameters('other', ['x'])").reads_others
    assert not read("node.set_parameters('other', {})").reads_others


@pytest.mark.parametrize(
    ('position', 'name'),
    [(0, 'a'), (1, 'b'), (2, None), ('b', 'b'), ('c', 'c'), ('a', None), ('d', None)],
)
def test_a_parameter_is_found_by_how_it_is_given(position, name):
    (function,) = ast.parse('def f(a, /, b, *, c): ...').body
    assert find_parameter(function, position) == name


@pytest.mark.parametrize(
    ('body', 'name'),
    [
        ("topic = 'x'\nnode.publish(topic, 1)", 'x'),
        ("topic: str = 'x'\nnode.publish(name=topic, payload=1)", 'x'),
        ('node.publish(TOPIC, 1)', 'y'),
        ("TOPIC = 'x'\nnode.publish(TOPIC, 1)", 'x'),
    ],
)
def test_a_name_that_is_one_text_for_good_is_that_text(body, name):
    lines = '\n'.join(f'    {line}' for line in body.splitlines())
    (function,) = ast.parse(f'def f(node):\n{lines}').body
    found = read_node_uses(function, 'node', ['node'], {'TOPIC': 'y'})
    assert [use.name for use in found.uses] == [name]
    assert found.open_kinds == set()


@pytest.mark.parametrize(
    'body',
    [
        "topic = 'x'\ntopic = 'y'\nnode.publish(topic, 1)",
        "topic = 'x'\nfor topic in 'ab': pass\nnode.publish(topic, 1)",
        "mode = 'x'\nnode.publish(mode, 1)",
        "if mode:\n    topic = 'x'\nnode.publish(topic, 1)",
        'node.publish(OTHER, 1)',
    ],
)
def test_a_name_that_may_be_something_else_is_unknown(body):
    found = read(body)
    assert found.uses == ()
    assert found.open_kinds == {'publisher'}


def test_a_constant_has_its_place_where_it_is_used():
    (use,) = read("topic = 'status'\nnode.publish(topic, 1)").uses
    assert (use.line, use.column, use.length) == (3, 18, 5)


@pytest.mark.parametrize(
    ('body', 'waits'),
    [
        ("def ask():\n    return node.call('x')\nask()", True),
        ("def ask():\n    return node.call('x')\nreturn ask", False),
        ("async def ask():\n    await node.call_async('x')\nask()", False),
        ("async def ask():\n    await node.call_async('x')\nawait ask()", True),
    ],
)
def test_a_function_inside_waits_if_it_is_run_there(body, waits):
    (use,) = read(body, head='async def f(node):', given=['node']).uses
    assert use.waits is waits
