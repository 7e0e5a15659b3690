"""Pieces of text that have broken readers of YAML, and expressions that could run for ever."""

SCALARS = [
    '', '~', 'null', 'true', 'True', 'yes', 'on', 'y', '.', '-', '--', '=', '<<', '*', '&', '!', '|', '>', '%', '@', '`', '?', ':', ',', '#',
    '0', '-0', '010', '0o17', '0x1F', '0b1', '1_000', '12:30:45', '2001-01-01', '1e3', '1e999', '-1e999', '.inf', '-.inf', '.nan', '.5', '5.', '1.5.2',
    '9223372036854775807', '9223372036854775808', '-9223372036854775809', '18446744073709551616', '1' * 300, '9' * 5000, '0.' + '1' * 5000, '1e' + '9' * 400,
    '0x' + 'f' * 300, 'a' * 300, 'a' * 70_000, '"' + 'b' * 70_000 + '"', '/' * 300, 'a/' * 200, '~/' + 'x' * 300, '/robot/', '//x', '{node}/x', '{ns', '}', 'a b', '0abc',
    '!!python/object:os.system x', '!!python/object/apply:os.system ["true"]', '!!python/name:os.system ""', '!!binary aGk=', '!!set {a, b}', '!!omap [a: 1]',
    '!!timestamp 2001-01-01', '!!int abc', '!!int 1.5', '!!float x', '!!bool 3', '!!null 1', '!!str 5', '!!map x', '!!seq {}', '!local x', '!', '!<tag:x> y', '!!float 1',
    '{}', '[]', '{a: 1}', '[1, a, null]', '[[[]]]', '{a: {b: {c: 1}}}', '[' * 99 + ']' * 99, '[' * 150 + ']' * 150, '{a: ' * 120 + '1' + '}' * 120, '[' * 5000,
    '"\\ud800"', '"\\U0010FFFF"', '"\\0"', '"\\x1b[2J"', '"\\u2028"', '"\\uFEFF"', '"\\u202Egpj"', "'it''s'", '"a\\\n b"', '"a', "'a", '"\\q"', '*unknown', '&a', '&a *a', '&a [*a]',
    'Ünïcödé', '日本語', '👩‍👩‍👧', 'é' * 200, 'ﬀ', 'İ', 'ß', 'a\u0301', '\u200b', '\u00a0', '\ufeff', '\u2028', '\x85', '\x0b', '\x0c', '\x00', '\x07', '\x1b', '\x7f', '\ud800'.encode('utf-8', 'replace').decode(),
    'std_msgs/msg/String', 'std_msgs/msg/Strin', 'std_msgs/String', '/msg/', 'a/msg/b', 'std_msgs/msg/String\\n', 'std_msgs/msg/' + 'S' * 300, '../../msg/X', 'builtin_interfaces/msg/Time', 'test_msgs/msg/Nested',
    'behaviours.greeter:reply', 'behaviours.greeter', ':', 'a:b:c', 'os:system', 'behaviours.greeter:nothing', '..:x', 'a' * 300 + ':b', '__main__:x', 'sys:path', 'ctypes:c_int', 'encodings:x', 'composer.cli.main:main',
    'sensor_data', 'services_default', 'infinite', 'best_available', 'reentrant', 'keep_all',
]  # fmt: skip

EXPRESSIONS = [
    'name', 'count', 'nothing', '1 / 0', '9 ** 9 ** 9', '2 ** -1', '(-8) ** 0.5', "'x' * 10 ** 9", '[1] * 10 ** 9', 'range(10 ** 12) | list', 'range(99999) | list', 'range(99999) | map("string") | join',
    "'x' | center(10 ** 9)", "'x'.ljust(10 ** 9)", "'%999999999d' % 1", "'%*d' % (10 ** 9, 1)", "'{:999999999}'.format(1)", "'{:{}}'.format(1, 10 ** 9)", "'{0.__class__}'.format(1)",
    "''.__class__.__mro__", 'range.__globals__', 'lipsum(n=10 ** 6)', 'cycler(1, 2).next()', 'namespace(a=1)', 'joiner()', 'dict(a=1)', 'self', 'loop.index', 'super()', 'caller()', 'import os', 'include "x"',
    'x.__init__.__globals__', "'x' | attr('__class__')", "[[['x' * 999] * 99] * 99] * 99", "('x' * 999).replace('', 'y' * 9999)", "'a' ~ 'b' ~ 1", '1 if false', '1 if false else [2]', 'a if b', '{1: 2}', '{"a": [1]}',
    'range(3)', 'not', '"\\ud800"', "'\\0'", '0x' + 'f' * 300, '1' * 5000, '1e999', '1e999 - 1e999', '(' * 300 + ')' * 300, '[' * 100 + ']' * 100, '-' * 3000 + '1', '1' + ' + 1' * 3000, 'x' + '.x' * 900,
    '1' + '|string' * 900, "range(9) | map('map', 'x') | list", '[3, 1] | sort', "['a', 1] | sort", '{} | dictsort', 'none', 'true', '1 is divisibleby 0', '1 is nothing', '1 | nothing', '}}', '{{', '{% if x %}', '# x', '', ' ',
    'range(99999)|list|sort|sort|sort|sort|sort|sort|sort', "range(999)|map('replace', '1', 'x' * 999)|list", '[[1]] * 9999 | sum(start=[])', "'x' | indent(10 ** 9)", "'<' | escape", "'x' | urlize", '1.5 | round(10 ** 9)',
    'env("HOME")', 'env("NO_SUCH")', 'here', 'find("std_msgs")', 'env(1)', 'env', 'find(range(3))',
]  # fmt: skip

# Entries for the end of a file; %s makes their keys differ.
BLOCKS = [
    'x-a%s: &a [x, x, x, x, x, x, x, x, x]\nx-b%s: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\nx-c%s: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b]\nx-d%s: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c]\n'
    'x-e%s: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d]\nx-f%s: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e]\nx-g%s: &g [*f, *f, *f, *f, *f, *f, *f, *f, *f]\n',
    'x-m%s: &m {a: 1}\nx-n%s: &n {<<: [*m, *m, *m, *m, *m, *m]}\nx-o%s: {<<: *n, <<: *m, b: 1}\n',
    'x-cycle%s: &cycle {a: *cycle}\n',
    'x-merge%s: {<<: 3}\n',
    'x-merge%s: {<<: [1, {a: 1}]}\n',
    'x-merge%s: &self {<<: *self}\n',
    '---\nversion: 1\n',
    '...\n',
    '%%YAML 1.1\n',
    '? [a, b]\n: 1\n',
    '? {a: 1}\n: 1\n',
    '1: 2\n',
    'null: 2\n',
    'x-tab%s:\n\t- a\n',
    'x-deep%s: ' + '[' * 90 + ']' * 90 + '\n',
    'x-keys%s: {' + ', '.join(f'k{i}: {i}' for i in range(2000)) + '}\n',
    'args: {name: rover, count: {default: 3}, rate: {type: double}, kind: {choices: [a, b]}}\n',
    'args: [1]\n',
    'args: {a-b: 1, in: 2, x: {type: integer, default: a, choices: []}}\n',
    'qos: {a: {profile: b}, b: {profile: a}, c: {profile: c}}\n',
    'interfaces: {std_msgs: nowhere, b: ., c: /, d: "\\0", e: ../../..}\n',
    'executor: {threads: 1.0, shutdown_timeout: .nan}\n',
    'defaults: {namespace: /a//b, qos: 5.0, log_level: loud}\n',
    'nodes: {n%s: {timers: {t: {period: 1, publish: p, message: {a: {b: [1, {c: *none}]}}}}}}\n',
    'include: [{file: nowhere.yaml}, {file: ., namespace: x}]\n',
    'foreach: {i: "{{ range(99999) }}"}\n',
]  # fmt: skip
