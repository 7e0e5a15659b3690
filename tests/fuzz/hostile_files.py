"""Systems that are made to take a check's time or memory, or to break it: a function for each.

A function writes the files of a system into a folder, where `system.yaml` is the main file. What
is only long is ten times shorter here than what was measured: `HOSTILE_DIVISOR=1` makes it longer.
"""

import os
from itertools import pairwise

HEAD = 'version: 1\n'
CASES = {}
DIVISOR = int(os.environ.get('HOSTILE_DIVISOR', '10'))
FEW = f'max_nodes: {10_000 // DIVISOR}\n'


def case(*rules):
    """Add a function to the table, with the rules that must find something in its system."""

    def add(function):
        CASES[function.__name__.strip('_')] = function, frozenset(rules)
        return function

    return add


def write(folder, text, name='system.yaml'):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())


def behaves(folder, source, names=('f',)):
    """Write a node for each function of a module, and the module."""
    timers = ''.join(
        f'  n_{name}: {{timers: {{t: {{period: 1, behaviour: "b:{name}"}}}}}}\n' for name in names
    )
    write(folder, f'{HEAD}nodes:\n{timers}')
    write(folder, source, 'b.py')


def declares(folder, definition):
    """Write a node that uses a message, and its definition; `None` for none yet."""
    node = 'n: {publishers: {p: {type: odd_interfaces/msg/Odd, topic: t, external: true}}}'
    write(folder, f'{HEAD}interfaces: {{odd_interfaces: odd}}\nnodes:\n  {node}\n')
    (folder / 'odd/msg').mkdir(parents=True)
    if definition is not None:
        write(folder, definition, 'odd/msg/Odd.msg')


def configures(folder, text):
    """Write a node with a parameter file; `None` for none yet."""
    write(folder, f'{HEAD}nodes: {{n: {{parameters: {{a: 1}}, parameter_files: [p.yaml]}}}}\n')
    if text is not None:
        write(folder, text, 'p.yaml')


# What is no file.


@case('unreadable-file')
def fifo(folder):
    os.mkfifo(folder / 'system.yaml')


@case('unreadable-file')
def device(folder):
    (folder / 'system.yaml').symlink_to('/dev/zero')


@case('unreadable-file')
def terminal(folder):
    (folder / 'system.yaml').symlink_to('/dev/ptmx')


@case('unreadable-file')
def link_to_itself(folder):
    (folder / 'system.yaml').symlink_to('system.yaml')


@case('unreadable-file')
def folder_as_file(folder):
    write(folder, f'{HEAD}nodes: {{n: {{parameter_files: [p.yaml]}}}}\n')
    (folder / 'p.yaml').mkdir()


@case('unreadable-file')
def sparse_terabyte(folder):
    with (folder / 'system.yaml').open('wb') as file:
        file.truncate(1 << 40)


@case('unreadable-file')
def fifo_of_parameters(folder):
    configures(folder, None)
    os.mkfifo(folder / 'p.yaml')


@case('unreadable-file')
def device_of_parameters(folder):
    configures(folder, None)
    (folder / 'p.yaml').symlink_to('/dev/zero')


@case('unreadable')
def fifo_of_a_message(folder):
    declares(folder, None)
    os.mkfifo(folder / 'odd/msg/Odd.msg')


@case('unreadable')
def device_of_a_message(folder):
    declares(folder, None)
    (folder / 'odd/msg/Odd.msg').symlink_to('/dev/zero')


@case('unreadable')
def sparse_message(folder):
    declares(folder, None)
    with (folder / 'odd/msg/Odd.msg').open('wb') as file:
        file.truncate(1 << 40)


@case('unknown-behaviour')
def fifo_of_a_module(folder):
    behaves(folder, '')
    (folder / 'b.py').unlink()
    os.mkfifo(folder / 'b.py')


@case('unreadable-file')
def fifo_of_an_include(folder):
    write(folder, f'{HEAD}include: {{a: {{file: a.yaml}}}}\n')
    os.mkfifo(folder / 'a.yaml')


@case('unreadable-file')
def include_of_a_link_to_itself(folder):
    write(folder, f'{HEAD}include: {{a: {{file: loop.yaml}}}}\n')
    (folder / 'loop.yaml').symlink_to('loop.yaml')


@case('missing-include')
def include_below_a_link_to_itself(folder):
    write(folder, f'{HEAD}include: {{a: {{file: loop/a.yaml}}}}\n')
    (folder / 'loop').symlink_to('loop')


@case('unreadable-file')
def parameter_file_of_a_link_to_itself(folder):
    configures(folder, None)
    (folder / 'p.yaml').symlink_to('p.yaml')


@case('unknown-interfaces')
def interfaces_of_a_link_to_itself(folder):
    declares(folder, None)
    (folder / 'odd/msg').rmdir()
    (folder / 'odd').rmdir()
    (folder / 'odd').symlink_to('odd')


@case('unknown-behaviour')
def module_of_a_link_to_itself(folder):
    behaves(folder, '')
    (folder / 'b.py').unlink()
    (folder / 'b.py').symlink_to('b.py')


# Includes.


@case('too-deep')
def chained_includes(folder, length=480):
    names = ['system', *(f'i{index}' for index in range(length))]
    for name, inner in pairwise(names):
        write(folder, f'{HEAD}include: {{a: {{file: {inner}.yaml}}}}\n', f'{name}.yaml')
    write(folder, f'{HEAD}nodes: {{}}\n', f'{names[-1]}.yaml')


@case('too-many-entries')
def diamonds_of_includes(folder, height=20):
    names = ['system', *(f'i{index}' for index in range(height))]
    for name, inner in pairwise(names):
        entries = ', '.join(f'{a}: {{file: {inner}.yaml, namespace: {a}}}' for a in 'ab')
        write(folder, f'{HEAD}{FEW}include: {{{entries}}}\n', f'{name}.yaml')
    write(folder, f'{HEAD}nodes: {{n: {{}}}}\n', f'{names[-1]}.yaml')


@case('too-many-entries')
def includes_of_foreach(folder):
    foreach = 'foreach: {i: "{{ range(100) }}"}'
    entry = '"a{{ i }}": {%s, file: %s.yaml, namespace: "a{{ i }}"}'
    write(folder, f'{HEAD}{FEW}include:\n  {entry % (foreach, "b")}\n')
    write(folder, f'{HEAD}include:\n  {entry % (foreach, "c")}\n', 'b.yaml')
    write(folder, f'{HEAD}nodes:\n  "n{{{{ i }}}}": {{{foreach}}}\n', 'c.yaml')


@case('include-cycle')
def includes_of_each_other(folder):
    names = [f'i{index}' for index in range(40)]
    entries = ', '.join(f'{name}: {{file: {name}.yaml, namespace: {name}}}' for name in names)
    for name in ('system', *names):
        write(folder, f'{HEAD}{FEW}include: {{{entries}}}\n', f'{name}.yaml')


@case('missing-include')
def thousands_of_missing_includes(folder):
    entries = ''.join(
        f'  i{index}: {{file: "{"x" * 200}{index}.yaml"}}\n' for index in range(5000 // DIVISOR)
    )
    write(folder, f'{HEAD}include:\n{entries}')


# YAML.


@case('alias-bomb')
def billion_laughs(folder):
    text = 'x-a: &a [x, x, x, x, x, x, x, x, x, x]\n'
    for one, other in pairwise('abcdefghij'):
        text += f'x-{other}: &{other} [{", ".join([f"*{one}"] * 10)}]\n'
    write(folder, f'{HEAD}{text}nodes: {{}}\n')


@case('too-deep')
def deep_lists(folder):
    write(folder, f'{HEAD}x-a: {"[" * 1_000_000}\n')


@case('too-deep')
def deep_mappings(folder):
    write(folder, f'{HEAD}x-a: {"{a: " * 1_000_000}\n')


@case('yaml-syntax')
def deep_blocks(folder):
    write(folder, f'{HEAD}x-a: {"- " * 1_000_000}\n')


@case('yaml-syntax')
def complex_keys(folder):
    write(folder, f'{HEAD}x-a: {"? " * 1_000_000}\n')


@case()
def enormous_scalar(folder):
    write(folder, f'{HEAD}x-a: "{"a" * 9_900_000}"\nnodes: {{}}\n')


@case('unreadable-file')
def millions_of_values(folder):
    write(folder, f'{HEAD}x-a: [{"1," * 4_000_000}]\nnodes: {{}}\n')


@case('unreadable-file')
def folded_scalar(folder):
    write(folder, f'{HEAD}x-a: >\n' + '  a\n\n' * 1_900_000 + 'nodes: {}\n')


@case('bad-scalar')
def long_number(folder):
    write(folder, f'{HEAD}nodes: {{n: {{parameters: {{a: {"9" * 5_000_000}}}}}}}\n')


@case('unknown-key')
def long_key(folder):
    write(folder, f'{HEAD}nodes: {{n: {{? {"k" * 5_000_000} : 1}}}}\n')


@case('bad-name')
def long_name(folder):
    write(folder, f'{HEAD}nodes: {{? {"n" * 5_000_000} : {{}}}}\n')


@case('bad-parameter')
def list_of_parameter_values(folder):
    write(
        folder, f'{HEAD}nodes: {{n: {{parameters: {{a: [{"1, " * (145_000 // DIVISOR)} a]}}}}}}\n'
    )


@case()
def hundred_thousand_parameters(folder):
    text = ''.join(f'      p{index}: 1\n' for index in range(70_000 // DIVISOR))
    write(folder, f'{HEAD}nodes:\n  n:\n    parameters:\n{text}')


@case('yaml-syntax')
def null_characters(folder):
    write(folder, HEAD.encode() + b'\0' * 1_000_000)


@case('unreadable-file')
def utf_16(folder):
    write(folder, f'{HEAD}nodes: {{}}\n'.encode('utf-16'))


@case('duplicate-key')
def same_key(folder):
    write(folder, f'{HEAD}nodes:\n' + '  n: {}\n' * (70_000 // DIVISOR))


@case('unknown-key')
def unknown_keys(folder):
    write(
        folder,
        HEAD + 'nodes:\n  n: {' + ', '.join(f'k{i}: 1' for i in range(70_000 // DIVISOR)) + '}\n',
    )


@case()
def merges(folder):
    text = 'x-a: &a {' + ', '.join(f'k{i}: 1' for i in range(1000)) + '}\n'
    text += f'x-b: {{<<: [{", ".join(["*a"] * 200)}]}}\n'
    write(folder, f'{HEAD}{text}nodes: {{}}\n')


# Expressions.


def value(folder, expression):
    text = expression.replace("'", "''")
    write(folder, f"{HEAD}nodes: {{n: {{parameters: {{a: '{{{{ {text} }}}}'}}}}}}\n")


@case('bad-expression')
def long_text(folder):
    value(folder, "'a' * 10 ** 9")


@case('bad-expression')
def wide_format(folder):
    value(folder, "'%1000000000d' | format(1)")


@case('bad-expression')
def long_range(folder):
    value(folder, 'range(10 ** 9)')


@case('bad-expression')
def long_loop(folder):
    value(folder, 'range(99999) | list | sort | reverse | list | sort | map("string") | join')


@case('bad-expression')
def nested_parentheses(folder):
    value(folder, '(' * 4000 + '1' + ')' * 4000)


@case('bad-expression')
def nested_braces(folder):
    value(folder, '{' * 4000)


@case('bad-expression')
def long_sum(folder):
    value(folder, '1' + ' + 1' * 2400)


@case('bad-expression')
def large_number(folder):
    value(folder, '9' * 5000)


@case('bad-expression')
def large_power(folder):
    value(folder, '9 ** 9 ** 9 ** 9')


@case('bad-expression')
def unfinished_expressions(folder):
    write(folder, f'{HEAD}nodes: {{n: {{parameters: {{a: "{"{{ a" * 1_000_000}"}}}}}}\n')


@case('undefined-name')
def undefined_names(folder):
    text = ''.join(
        f'      p{index}: "{{{{ nothing_{index} }}}}"\n' for index in range(20_000 // DIVISOR)
    )
    write(folder, f'{HEAD}args: {{a: 1, b: 2}}\nnodes:\n  n:\n    parameters:\n{text}')


@case('bad-argument-declaration')
def argument_names(folder):
    text = ''.join(f'  a {index}: 1\n' for index in range(50_000 // DIVISOR))
    write(folder, f'{HEAD}args:\n{text}nodes: {{}}\n')


@case('undefined-name')
def names_among_arguments(folder):
    arguments = ''.join(f'  argument_{index}: 1\n' for index in range(1_900))
    text = ''.join(
        f'      p{index}: "{{{{ argument_x{index} }}}}"\n' for index in range(5_000 // DIVISOR)
    )
    write(folder, f'{HEAD}args:\n{arguments}nodes:\n  n:\n    parameters:\n{text}')


@case('too-many-entries')
def foreach_of_variables(folder, count=40):
    variables = ', '.join(f'v{index}: [0, 1]' for index in range(count))
    name = ''.join(f'{{{{ v{index} }}}}' for index in range(count))
    write(folder, f'{HEAD}nodes:\n  "n{name}": {{foreach: {{{variables}}}}}\n')


@case('bad-foreach')
def foreach_that_ends_empty(folder, count=40):
    variables = ', '.join(f'v{index}: [0, 1]' for index in range(count))
    write(folder, f'{HEAD}nodes:\n  n: {{foreach: {{{variables}, last: 1}}}}\n')


@case('too-many-entries')
def foreach_over_a_range(folder):
    body = 'publishers: {p: {type: std_msgs/msg/String, topic: t}}'
    text = f'  "n{{{{ i }}}}": {{foreach: {{i: "{{{{ range(20000) }}}}"}}, {body}}}\n'
    text += ''.join(
        f'  m{index}: {{subscriptions: {{s: {{type: std_msgs/msg/String, topic: t{index}, behaviour: "b:f"}}}}}}\n'
        for index in range(100)
    )
    write(folder, f'{HEAD}nodes:\n{text}')


@case('too-many-entries')
def foreach_of_nothing(folder):
    lists = ', '.join(f'v{index}: "{{{{ range(9000) }}}}"' for index in range(3))
    write(folder, f'{HEAD}nodes:\n  n: {{foreach: {{{lists}}}, when: false}}\n')


@case('bad-foreach')
def enormous_max_nodes(folder):
    foreach = '{foreach: {i: "{{ range(90000) }}"}}'
    write(folder, f'{HEAD}max_nodes: 1{"0" * 200}\nnodes: {{"n{{{{ i }}}}": {foreach}}}\n')


@case('missing-include', 'unreadable-file', 'unknown-interfaces', 'bad-name')
def null_characters_in_paths(folder):
    text = 'interfaces: {"a": "b\\0"}\ninclude: {x: {file: "a\\0b"}}\n'
    text += 'nodes: {n: {namespace: "a\\0", parameter_files: ["p\\0"]}}\n'
    write(folder, HEAD + text)


# Python.


@case()
def long_sum_in_python(folder, count=2500):
    behaves(folder, f'def f(node):\n    return {" + ".join(["1"] * count)}\n')


@case()
def chain_of_calls(folder, count=900):
    behaves(folder, f'def f(node):\n    return node{".a()" * count}\n')


@case()
def deep_blocks_in_python(folder, count=98):
    lines = [f'{" " * (index + 1)}if node.name:\n' for index in range(count)]
    behaves(folder, 'def f(node):\n' + ''.join(lines) + ' ' * (count + 1) + 'pass\n')


@case()
def chain_of_conditions(folder, count=900):
    behaves(folder, f'def f(node):\n    return {"1 if node.name else " * count} 2\n')


@case()
def deep_annotation(folder, count=2500):
    behaves(folder, f'def f(node, x: {" | ".join(["int"] * count)} = 1):\n    pass\n')


@case('broken-module')
def deeper_than_python(folder):
    behaves(folder, f'def f(node):\n    return {"-" * 90_000}1\n')


@case('broken-module')
def too_many_parentheses(folder):
    behaves(folder, f'def f(node):\n    return {"(" * 49_000}1{")" * 49_000}\n')


@case()
def comprehensions(folder):
    inner = '1'
    for index in range(150):
        inner = f'[{inner} for x{index} in y]'
    behaves(folder, f'def f(node):\n    return {inner}\n')


@case('unread-module')
def module_of_18_mb(folder):
    behaves(folder, 'def f(node): pass\n' + 'x = [1, 2]\n' * 1_640_000)


@case('unread-module')
def dense_module(folder):
    behaves(folder, 'def f(node): pass\n' + 'x\n' * 1_000_000)


@case('unread-module')
def functions(folder):
    text = ''.join(f'def g{index}(node): node.publish("p")\n' for index in range(200_000))
    behaves(folder, text + 'def f(node): pass\n')


@case()
def functions_that_call_each_other(folder, count=120):
    names = [f'f{index}' for index in range(count)]
    calls = '; '.join(f'{name}(node)' for name in names)
    text = ''.join(f'def {name}(node): node.publish("{name}"); {calls}\n' for name in names)
    behaves(folder, text, names)


@case('broken-module')
def large_number_constant(folder):
    behaves(folder, f'f = {"9" * 100_000}\n')


@case('broken-module')
def python_with_null_characters(folder):
    behaves(folder, 'def f(node): pass\n\0\n')


@case('broken-module')
def python_of_another_encoding(folder):
    behaves(folder, 'def f(node): pass\n'.encode('utf-16'))


@case('broken-module')
def nested_formats(folder):
    behaves(folder, 'def f(node):\n    return ' + 'f"{' * 2000 + '1' + '}"' * 2000 + '\n')


@case()
def imports_of_each_other(folder):
    behaves(folder, 'from c import f\n')
    write(folder, 'from b import f\n', 'c.py')


@case()
def chain_of_imports(folder, count=300):
    behaves(folder, 'from b0 import f\n')
    for index in range(count):
        write(folder, f'from b{index + 1} import f\n', f'b{index}.py')
    write(folder, 'def f(node): pass\n', f'b{count}.py')


@case()
def deep_helpers(folder, count=600):
    text = ''.join(f'def f{index}(node): f{index + 1}(node)\n' for index in range(count))
    behaves(folder, f'def f(node): f0(node)\n{text}def f{count}(node): pass\n')


@case('bad-signature')
def thousands_of_parameters_in_python(folder):
    names = ', '.join(f'a{index}' for index in range(3_000))
    behaves(folder, f'def f(node, {names}): pass\n')


@case('unknown-behaviour')
def dotted_module(folder):
    write(
        folder,
        f'{HEAD}nodes: {{n: {{timers: {{t: {{period: 1, behaviour: "{"a." * 100_000}a:f"}}}}}}}}\n',
    )


@case('unknown-publisher')
def thousands_of_unknown_publishers(folder):
    lines = ''.join(f'    node.publish("p{index}", {{}})\n' for index in range(7_000 // DIVISOR))
    behaves(folder, f'def f(node):\n{lines}')


# Interface definitions.


@case('unreadable')
def hundred_thousand_fields(folder):
    declares(folder, ''.join(f'int32 f{index}\n' for index in range(100_000)))


@case()
def enormous_bound(folder):
    declares(folder, f'int32[{2**64}] a\nint32[<={2**70}] b\nstring<={2**64} c\n')


@case('bad-type')
def bound_of_many_digits(folder):
    declares(folder, f'int32[{"9" * 90_000}] a\n')


@case('unknown-type')
def unknown_types(folder):
    declares(folder, ''.join(f'Type{index} f{index}\n' for index in range(5_000 // DIVISOR)))


@case('bad-constant')
def constant_of_many_digits(folder):
    declares(folder, f'int32 A={"9" * 90_000}\n')


@case('bad-name')
def long_field_name(folder):
    declares(folder, f'int32 {"A" * 90_000}\n')


@case('bad-separator')
def message_that_is_a_line(folder):
    declares(folder, '-' * 90_000)


@case()
def long_default(folder):
    declares(folder, f'int32[] a [{", ".join(["1"] * (25_000 // DIVISOR))}]\n')


@case('endless-type')
def message_in_itself(folder):
    declares(folder, 'Odd a\n')


@case()
def diamonds_of_messages(folder, height=30):
    declares(folder, 'M0 a\nM0 b\n')
    for index in range(height):
        write(folder, f'M{index + 1} a\nM{index + 1} b\n', f'odd/msg/M{index}.msg')
    write(folder, 'int32 a\n', f'odd/msg/M{height}.msg')


@case()
def chain_of_messages(folder, length=1200):
    declares(folder, 'M0 a\n')
    for index in range(length):
        write(folder, f'M{index + 1} a\n', f'odd/msg/M{index}.msg')
    write(folder, 'int32 a\n', f'odd/msg/M{length}.msg')


@case()
def thousands_of_messages(folder, count=5000 // DIVISOR):
    declares(folder, 'int32 a\n')
    for index in range(count):
        write(folder, 'int32 a\n', f'odd/msg/M{index}.msg')


# Parameter files.


@case('too-deep')
def deep_parameters(folder):
    configures(folder, 'n:\n  ros__parameters: {a: 1, ' + 'b: {' * 2_000_000)


@case('bad-parameter-file')
def aliases_of_parameters(folder):
    configures(folder, 'x: &a [1]\nn:\n  ros__parameters: {a: *a}\n')


@case('undeclared-parameter')
def hundred_thousand_parameters_of_a_file(folder):
    text = ''.join(f'    p{index}: 1\n' for index in range(70_000 // DIVISOR))
    configures(folder, f'n:\n  ros__parameters:\n{text}')


@case('unmatched-node-name')
def patterns_of_parameters(folder):
    text = ''.join(
        f'/{"**/" * 30}x{index}: {{ros__parameters: {{a: 1}}}}\n'
        for index in range(2000 // DIVISOR)
    )
    configures(folder, text)


@case('bad-parameter-file')
def documents_of_parameters(folder):
    configures(folder, '---\n' * (145_000 // DIVISOR))


@case('unreadable-file')
def many_parameter_files(folder, count=8):
    names = [f'p{index}.yaml' for index in range(count)]
    write(folder, f'{HEAD}nodes: {{n: {{parameter_files: [{", ".join(names)}]}}}}\n')
    text = ''.join(f'    p{index}: 1\n' for index in range(20_000))
    for name in names:
        write(folder, f'n:\n  ros__parameters:\n{text}', name)


# Large systems, wrong throughout.


@case('unknown-type')
def thousands_of_unknown_types(folder):
    text = ''.join(
        f'  n{index}: {{publishers: {{p: {{type: std_msgs/msg/Strin{index}, topic: t{index}}}}}}}\n'
        for index in range(5000 // DIVISOR)
    )
    write(folder, f'{HEAD}nodes:\n{text}')


@case()
def similar_topics(folder):
    text = ''.join(
        f'  n{index}: {{publishers: {{p: {{type: std_msgs/msg/String, topic: a_long_topic_name_{index}}}}},'
        f' subscriptions: {{s: {{type: std_msgs/msg/String, topic: a_long_topic_nam_{index}, behaviour: "b:f"}}}}}}\n'
        for index in range(2000 // DIVISOR)
    )
    write(folder, 'def f(node, message): node.publish("p")\n', 'b.py')
    write(folder, f'{HEAD}nodes:\n{text}')


@case()
def one_topic_for_all(folder):
    entity = 'type: std_msgs/msg/String, topic: t'
    text = ''.join(
        f'  n{index}: {{publishers: {{p: {{{entity}}}}}, subscriptions: {{s: {{{entity}, behaviour: "b:f"}}}}}}\n'
        for index in range(2000 // DIVISOR)
    )
    write(folder, 'def f(node, message): node.publish("p")\n', 'b.py')
    write(folder, f'{HEAD}nodes:\n{text}')


@case('wait-cycle')
def processes_that_wait(folder):
    text = ''.join(
        f'  p{index}: {{command: [x], wait_for: [{{process: p{(index + 1) % 3000}}}]}}\n'
        for index in range(3000)
    )
    write(folder, f'{HEAD}nodes: {{}}\nprocesses:\n{text}')


@case('cyclic-qos-profile')
def chain_of_profiles(folder):
    text = ''.join(
        f'  q{index}: {{profile: q{index + 1}}}\n' for index in range(20_000 // DIVISOR)
    )
    write(folder, f'{HEAD}qos:\n{text}  q{20_000 // DIVISOR}: {{profile: q0}}\nnodes: {{}}\n')


@case()
def fields(folder):
    declares(folder, ''.join(f'int32 f{index}\n' for index in range(7_000 // DIVISOR)))


@case('unreadable')
def large_package(folder):
    declares(folder, 'int32 a\n')
    for index in range(40):
        write(folder, 'int32 a\n' + f'# {"a" * 90_000}\n', f'odd/msg/M{index}.msg')


@case('bad-expression')
def deep_attributes(folder):
    value(folder, f'a{".a" * 4000}')


@case('bad-expression')
def catastrophic_pattern(folder):
    value(folder, f"'{'a' * 4000}' | replace('', '{'b' * 4000}')")


@case('unread-module')
def many_large_modules(folder):
    timers = ''.join(f'    t{i}: {{period: 1, behaviour: "b{i}:f"}}\n' for i in range(40))
    write(folder, f'{HEAD}nodes:\n  n:\n   timers:\n{timers}')
    for index in range(40):
        write(folder, 'def f(node): pass\n' + 'x = [1, 2]\n' * 20_000, f'b{index}.py')


@case('unknown-rule')
def comments_with_unknown_rules(folder):
    comments = '# composer: ignore[a, b]\n' * (100_000 // DIVISOR)
    write(folder, f'{HEAD}nodes: {{}}\n{comments}')


@case('unmatched-node-name')
def wildcards(folder):
    nodes = ''.join(f'  n{i}: {{parameter_files: [p.yaml]}}\n' for i in range(1000))
    write(folder, f'{HEAD}nodes:\n{nodes}')
    patterns = (f'/**/x{i}/*: {{ros__parameters: {{a: 1}}}}\n' for i in range(10_000 // DIVISOR))
    write(folder, ''.join(patterns), 'p.yaml')


@case('unreadable')
def packages_of_interfaces(folder):
    packages = ', '.join(f'odd{index}: odd' for index in range(60))
    write(folder, f'{HEAD}interfaces: {{{packages}}}\nnodes: {{}}\n')
    (folder / 'odd/msg').mkdir(parents=True)
    fields = ''.join(f'int32 a{index}\n' for index in range(600))
    for index in range(30):
        write(folder, fields, f'odd/msg/M{index}.msg')


@case('bad-node-interface')
def nodl_of_many_mistakes(folder):
    parameters = (f'  p{index}: {{type: x}}\n' for index in range(20_000 // DIVISOR))
    write(folder, f'nodl_version: 2\nparameters:\n{"".join(parameters)}', 'n.yaml')
    write(folder, f'{HEAD}processes: {{p: {{command: [sh], interface: n.yaml}}}}\n')


@case()
def launch_file_of_merges(folder):
    levels = (f'a{i}: &a{i} {{<<: [{", ".join([f"*a{i - 1}"] * 10)}]}}\n' for i in range(1, 9))
    write(folder, f'launch: []\na0: &a0 {{x: 1}}\n{"".join(levels)}', 'l.yaml')
    write(folder, f'{HEAD}processes: {{p: {{launch: l.yaml}}}}\n')
