"""Systems that are made to take a check's time or memory, or to break it: a function for each.

A function writes the files of a system into a folder, where `system.yaml` is the main file. What
is only long is sixteen times shorter here than what was measured: `HOSTILE_DIVISOR=1` makes it longer.
"""

import os
from itertools import pairwise

HEAD = 'version: 1\n'
CASES = {}
DIVISOR = int(os.environ.get('HOSTILE_DIVISOR', '16'))
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
def link_to_itself(folder):
    (folder / 'system.yaml').symlink_to('system.yaml')


@case('unreadable-file')
def folder_as_file(folder):
    write(folder, f'{HEAD}nodes: {{n: {{parameter_files: [p.yaml]}}}}\n')
    (folder / 'p.yaml').mkdir()


@case('unreadable')
def fifo_of_a_message(folder):
    declares(folder, None)
    os.mkfifo(folder / 'odd/msg/Odd.msg')


@case('unknown-behaviour')
def fifo_of_a_module(folder):
    behaves(folder, '')
    (folder / 'b.py').unlink()
    os.mkfifo(folder / 'b.py')


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


# YAML.


@case('alias-bomb')
def billion_laughs(folder):
    text = 'x-a: &a [x, x, x, x, x, x, x, x, x, x]\n'
    for one, other in pairwise('abcdefghij'):
        text += f'x-{other}: &{other} [{", ".join([f"*{one}"] * 10)}]\n'
    write(folder, f'{HEAD}{text}nodes: {{}}\n')


@case('too-deep')
def deep_mappings(folder):
    write(folder, f'{HEAD}x-a: {"{a: " * 1_000_000}\n')


@case()
def enormous_scalar(folder):
    write(folder, f'{HEAD}x-a: "{"a" * 9_900_000}"\nnodes: {{}}\n')


@case('bad-scalar')
def long_number(folder):
    write(folder, f'{HEAD}nodes: {{n: {{parameters: {{a: {"9" * 5_000_000}}}}}}}\n')


@case('bad-parameter')
def list_of_parameter_values(folder):
    write(
        folder, f'{HEAD}nodes: {{n: {{parameters: {{a: [{"1, " * (145_000 // DIVISOR)} a]}}}}}}\n'
    )


# Expressions.


def value(folder, expression):
    text = expression.replace("'", "''")
    write(folder, f"{HEAD}nodes: {{n: {{parameters: {{a: '{{{{ {text} }}}}'}}}}}}\n")


@case('bad-expression')
def long_text(folder):
    value(folder, "'a' * 10 ** 9")


@case('bad-expression')
def nested_parentheses(folder):
    value(folder, '(' * 4000 + '1' + ')' * 4000)


@case('bad-expression')
def large_power(folder):
    value(folder, '9 ** 9 ** 9 ** 9')


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


@case('missing-include', 'unreadable-file', 'unknown-interfaces', 'bad-name')
def null_characters_in_paths(folder):
    text = 'interfaces: {"a": "b\\0"}\ninclude: {x: {file: "a\\0b"}}\n'
    text += 'nodes: {n: {namespace: "a\\0", parameter_files: ["p\\0"]}}\n'
    write(folder, HEAD + text)


# Python.


@case()
def long_sum_in_python(folder, count=2500):
    behaves(folder, f'def f(node):\n    return {" + ".join(["1"] * count)}\n')


@case('broken-module')
def deeper_than_python(folder):
    behaves(folder, f'def f(node):\n    return {"-" * 90_000}1\n')


@case('unread-module')
def module_of_18_mb(folder):
    behaves(folder, 'def f(node): pass\n' + 'x = [1, 2]\n' * 1_640_000)


@case()
def imports_of_each_other(folder):
    behaves(folder, 'from c import f\n')
    write(folder, 'from b import f\n', 'c.py')


@case()
def deep_helpers(folder, count=600):
    text = ''.join(f'def f{index}(node): f{index + 1}(node)\n' for index in range(count))
    behaves(folder, f'def f(node): f0(node)\n{text}def f{count}(node): pass\n')


# Interface definitions.


@case('unreadable')
def hundred_thousand_fields(folder):
    declares(folder, ''.join(f'int32 f{index}\n' for index in range(100_000)))


@case('bad-constant')
def constant_of_many_digits(folder):
    declares(folder, f'int32 A={"9" * 90_000}\n')


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


# Parameter files.


@case('too-deep')
def deep_parameters(folder):
    configures(folder, 'n:\n  ros__parameters: {a: 1, ' + 'b: {' * 2_000_000)


@case('unmatched-node-name')
def patterns_of_parameters(folder):
    text = ''.join(
        f'/{"**/" * 30}x{index}: {{ros__parameters: {{a: 1}}}}\n'
        for index in range(2000 // DIVISOR)
    )
    configures(folder, text)


@case('unreadable-file')
def many_parameter_files(folder, count=4):
    names = [f'p{index}.yaml' for index in range(count)]
    write(folder, f'{HEAD}nodes: {{n: {{parameter_files: [{", ".join(names)}]}}}}\n')
    text = ''.join(f'    p{index}: 1\n' for index in range(40_000))
    for name in names:
        write(folder, f'n:\n  ros__parameters:\n{text}', name)


# Large systems, wrong throughout.


@case()
def similar_topics(folder):
    text = ''.join(
        f'  n{index}: {{publishers: {{p: {{type: std_msgs/msg/String, topic: a_long_topic_name_{index}}}}},'
        f' subscriptions: {{s: {{type: std_msgs/msg/String, topic: a_long_topic_nam_{index}, behaviour: "b:f"}}}}}}\n'
        for index in range(2000 // DIVISOR)
    )
    write(folder, 'def f(node, message): node.publish("p")\n', 'b.py')
    write(folder, f'{HEAD}nodes:\n{text}')


@case('cyclic-qos-profile')
def chain_of_profiles(folder):
    text = ''.join(
        f'  q{index}: {{profile: q{index + 1}}}\n' for index in range(20_000 // DIVISOR)
    )
    write(folder, f'{HEAD}qos:\n{text}  q{20_000 // DIVISOR}: {{profile: q0}}\nnodes: {{}}\n')


@case('unreadable')
def large_package(folder):
    declares(folder, 'int32 a\n')
    for index in range(40):
        write(folder, 'int32 a\n' + f'# {"a" * 90_000}\n', f'odd/msg/M{index}.msg')


@case()
def launch_file_of_merges(folder):
    levels = (f'a{i}: &a{i} {{<<: [{", ".join([f"*a{i - 1}"] * 10)}]}}\n' for i in range(1, 9))
    write(folder, f'launch: []\na0: &a0 {{x: 1}}\n{"".join(levels)}', 'l.yaml')
    write(folder, f'{HEAD}processes: {{p: {{launch: l.yaml}}}}\n')
