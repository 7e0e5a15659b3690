"""YAML text → data and positions; whatever the text is, findings are returned and nothing raised."""

from pathlib import Path

import pytest

import composer
from composer.input_limits import MAX_FILE_BYTES
from composer.language.pipeline import load_system
from composer.reports.text import render_finding
from composer.yaml_text.reader import parse_document, read_document

SHIPPED = sorted((Path(composer.__file__).parents[1] / 'configs').glob('*.yaml'))


def parse(text):
    return parse_document(text if isinstance(text, bytes) else text.encode(), 'file.yaml')


def read(text):
    """Return the data of a text in which nothing is wrong."""
    document = parse(text)
    assert [render_finding(finding) for finding in document.diagnostics] == []
    return document.data


def said(text):
    return [render_finding(finding) for finding in parse(text).diagnostics]


def first_line(text):
    """Return the first line of the only finding."""
    (finding,) = said(text)
    return finding.splitlines()[0]


def place(span):
    return span.line, span.column, span.text


# Positions


def test_keys_and_values_keep_their_places():
    positions = parse(
        'version: 1\n'
        '"two words":   \'quoted value\'\n'
        'nodes:\n'
        '  rover: {rate: 10, names: [a, "b c"]}\n'
        '  lander:\n'
        '    - first\n'
        '    -   second: deep\n'
    ).positions
    assert place(positions.keys['version',]) == (1, 1, 'version')
    assert place(positions.values['version',]) == (1, 10, '1')
    assert place(positions.keys['two words',]) == (2, 1, '"two words"')
    assert place(positions.values['two words',]) == (2, 16, "'quoted value'")
    assert place(positions.keys['nodes', 'rover']) == (4, 3, 'rover')
    assert place(positions.values['nodes', 'rover']) == (4, 10, '{')
    assert place(positions.values['nodes', 'rover', 'rate']) == (4, 17, '10')
    assert place(positions.values['nodes', 'rover', 'names', 1]) == (4, 32, '"b c"')
    assert place(positions.values['nodes', 'lander', 0]) == (6, 7, 'first')
    assert place(positions.keys['nodes', 'lander', 1, 'second']) == (7, 9, 'second')
    assert place(positions.values['nodes', 'lander', 1, 'second']) == (7, 17, 'deep')


def test_every_key_and_value_has_a_place():
    document = parse(SHIPPED[0].read_bytes())

    def walk(data, path):
        assert path in document.positions.values
        if isinstance(data, dict):
            for key, value in data.items():
                assert document.positions.keys[(*path, key)].text.strip('\'"') == key
                walk(value, (*path, key))
        elif isinstance(data, list):
            for index, item in enumerate(data):
                walk(item, (*path, index))

    walk(document.data, ())


def test_what_has_no_place_is_where_its_surroundings_are():
    positions = parse('nodes:\n  rover: {}\n').positions
    assert place(positions.value(('nodes', 'rover', 'timers', 'tick'))) == (2, 3, 'rover')
    assert place(positions.key(('nodes', 'lander'))) == (1, 1, 'nodes')
    assert place(positions.value(('executor',))) == (1, 1, 'n')


# Anchors, aliases and merge keys


def test_aliases_are_the_values_of_their_anchors():
    assert read('a: &x {one: [1, &y two]}\nb: *x\nc: *y\n') == {
        'a': {'one': [1, 'two']},
        'b': {'one': [1, 'two']},
        'c': 'two',
    }


def test_what_an_alias_brings_stands_where_its_anchor_is():
    positions = parse('a: &x {one: 1}\nb: *x\n').positions
    assert place(positions.keys['b',]) == (2, 1, 'b')
    assert place(positions.keys['b', 'one']) == (1, 8, 'one')
    assert place(positions.values['b', 'one']) == (1, 13, '1')


def test_merged_keys_stand_where_they_are_written():
    document = parse(
        'base: &base {one: 1, two: 2}\n'
        'more: &more {two: 22, three: 33}\n'
        'all:\n'
        '  two: own\n'
        '  <<: [*base, *more]\n'
    )
    assert document.data['all'] == {'two': 'own', 'one': 1, 'three': 33}
    assert place(document.positions.values['all', 'two']) == (4, 8, 'own')
    assert place(document.positions.values['all', 'one']) == (1, 19, '1')
    assert place(document.positions.keys['all', 'three']) == (2, 23, 'three')


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('a: &a [*a]', '1:8: error[cyclic-alias]: the alias *a contains itself'),
        ('a: &a\n  <<: *a', '2:7: error[cyclic-alias]: the alias *a contains itself'),
        ('a: &a {b: &b {c: *a}}', '1:18: error[cyclic-alias]: the alias *a contains itself'),
        ('? &a [*a]\n: 1', '1:7: error[cyclic-alias]: the alias *a contains itself'),
        ('a: *b\nb: &b 1', '1:4: error[unknown-alias]: no anchor &b before this alias'),
        (
            'a: {<<: 3}',
            '1:9: error[bad-merge]: the merge key << takes a mapping, or a list of them',
        ),
    ],
)
def test_an_impossible_alias_is_a_finding(text, line):
    assert first_line(text) == f'file.yaml:{line}'


def test_merges_do_not_nest_deeper_than_text():
    lines = ['x0: &x0 {a: 1}', *(f'x{n}: &x{n} {{<<: *x{n - 1}}}' for n in range(1, 2_000))]
    assert 'error[too-deep]: merges nest more than 100 levels deep' in first_line('\n'.join(lines))


# Duplicate keys


def test_a_duplicate_key_shows_both_places():
    assert said('nodes:\n  rover: {}\n  "rover": {}\n') == [
        "file.yaml:3:3: error[duplicate-key]: the key 'rover' appears twice in one mapping\n"
        '  3 |   "rover": {}\n'
        '    |   ^^^^^^^\n'
        '  file.yaml:2:3: first used here\n'
        '  help: keep one; the first is on line 2'
    ]


# Texts that are not as they should be


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('', 'file.yaml: error[unreadable-file]: the file is empty'),
        ('\ufeff', 'file.yaml: error[unreadable-file]: the file is empty'),
        (
            '- version: 1',
            'file.yaml:1:1: error[wrong-type]: a file must be a mapping with the keys version and nodes',
        ),
        (
            b'version: 1\nname: caf\xe9\n',
            'file.yaml: error[unreadable-file]: the file is not UTF-8: byte 0xe9 in line 2',
        ),
        (
            'a: é\r\nb: é\r\nc: \x1b[31m',
            'file.yaml:3:4: error[yaml-syntax]: YAML does not allow the character U+001B',
        ),
        (
            'a: 1\n---\nb: 2\n',
            'file.yaml:2:1: error[several-documents]: a file holds only one YAML document',
        ),
    ],
)
def test_an_unreadable_text_gets_one_clear_line(text, line):
    assert first_line(text) == line


@pytest.mark.parametrize(
    ('text', 'line', 'column', 'help_text'),
    [
        ('a:\n\tb: 1\n', 2, 1, 'indent YAML with spaces, not tabs'),
        ('a: b: c\n', 1, 5, "put a value that contains ': ' in quotes"),
        ('a:1.5\nb: 3\n', 1, 1, "write 'a: 1.5'"),
        ('t:\n  - b:x.y\n    c: 3\n', 2, 5, "write 'b: x.y'"),
        ('a: [1, 2\nb: 3\n', 2, 2, "close the bracket with ']'"),
        ('a:\n  b: 1\n c: 2\n', 3, 2, 'indent all keys of a mapping alike'),
        ('a: @b\n', 1, 4, 'put a value that begins with it in quotes'),
        ('a: "\\q"\n', 1, 5, None),
        ('%YAML 9.9\n---\na: 1\n', 1, 1, None),
    ],
)
def test_a_finding_of_syntax_has_a_place(text, line, column, help_text):
    (finding,) = parse(text).diagnostics
    assert finding.rule == 'yaml-syntax'
    assert finding.message.startswith('this is not YAML: ')
    assert (finding.span.line, finding.span.column, finding.help) == (line, column, help_text)


def test_an_open_quote_says_where_it_was_opened():
    expected = 'file.yaml:2:4: error[yaml-syntax]: this is not YAML: the quote that begins here is not closed in its line'  # fmt: skip
    assert first_line('a: 1\nb: "never\nclosed\n') == expected
    # Another quote closes it.
    assert first_line('a: 1\nb: "never\nc: "closed"\n') == expected


@pytest.mark.parametrize(
    ('opening', 'levels'), [('[', 10_000), ('- ', 300), ('? ', 300), ('[{é: ', 10_000)]
)
def test_thousands_of_levels_are_the_finding_of_the_first_beyond_the_limit(opening, levels):
    """PyYAML 6.0.4 refuses 1,000 levels by itself, and names the last of them."""
    levels_each = opening.count('[{') + 1
    column = 100 // levels_each * len(opening) + 1
    assert first_line(opening * levels) == (
        f'file.yaml:1:{column}: error[too-deep]: the data is nested more than 100 levels deep'
    )


def test_a_hundred_levels_are_read():
    document = parse('a: ' + '[' * 99 + ']' * 99)
    assert document.diagnostics == []
    assert document.data['a'][0][0][0]


@pytest.mark.parametrize(
    'text',
    [
        'version: 1\r\nnodes:\r\n  rover: {rate: 1}\r\n',
        'version: 1\rnodes:\r  rover: {rate: 1}\r',
        '\ufeffversion: 1\nnodes:\n  rover: {rate: 1}',
        '%YAML 1.2\n---\nversion: 1\nnodes:\n  rover: {rate: 1}\n...\n',
        '%YAML 1.1\n--- {version: 1, nodes: {rover: {rate: 1}}}',
    ],
)
def test_line_ends_marks_and_directives_do_not_matter(text):
    assert read(text) == {'version': 1, 'nodes': {'rover': {'rate': 1}}}


def test_yaml_is_read_by_the_core_schema():
    assert read('{a: on, b: 12:30, c: 010, d: 1e3, e: "1", f: , g: !!str 1, h: 0o17, i: no}') == {
        'a': 'on',
        'b': '12:30',
        'c': 10,
        'd': 1000.0,
        'e': '1',
        'f': None,
        'g': '1',
        'h': 15,
        'i': 'no',
    }


@pytest.mark.parametrize(
    ('text', 'line'),
    [
        ('a: !own 1', "1:4: error[bad-scalar]: the tag !own is not part of YAML's core schema"),
        ('a: !!int x', "1:4: error[bad-scalar]: 'x' is not a !!int"),
        (
            'a: !!python/object/apply:os.system [x]',
            '1:4: error[bad-tag]: a !!python/object/apply:os.system is not allowed here',
        ),
        ('1: a', '1:1: error[bad-key]: a key must be a string, and 1 is not'),
        ('?\n: a', '1:2: error[bad-key]: a key must be a string, and this one is empty'),
        ('[a]: b', '1:1: error[bad-key]: a key must be a string, not a list or a mapping'),
    ],
)
def test_tags_and_keys_are_those_of_plain_data(text, line):
    assert first_line(text) == f'file.yaml:{line}'


# Files


def test_a_file_of_fifty_megabytes_is_refused(tmp_path):
    path = tmp_path / 'big.yaml'
    with path.open('wb') as file:
        file.write(b'version: 1\nnodes: {}\n#')
        file.truncate(50_000_000)
    (finding,) = read_document(path).diagnostics
    assert render_finding(finding) == (
        f'{path}: error[unreadable-file]: the file is larger than 10 MB'
    )


def test_a_file_of_the_largest_size_is_read(tmp_path):
    path = tmp_path / 'big.yaml'
    text = b'version: 1\nnodes: {}\n#'
    path.write_bytes(text + b'x' * (MAX_FILE_BYTES - len(text)))
    assert read_document(path).data == {'version': 1, 'nodes': {}}


def test_what_cannot_be_opened_says_why(tmp_path):
    missing = tmp_path / 'missing.yaml'
    loop = tmp_path / 'loop.yaml'
    loop.symlink_to(loop)
    reasons = {
        missing: 'No such file or directory',
        tmp_path: 'Is a directory',
        loop: 'Too many levels of symbolic links',
        Path('nul\0byte'): 'embedded null byte',
        tmp_path / ('x' * 300): 'File name too long',
    }
    for path, reason in reasons.items():
        system = load_system(path)
        (finding,) = system.diagnostics
        assert finding.message == f'cannot read the file: {reason}'
        assert system.spec is None


# Whatever is done to a file, it is read, checked and shown without an exception.


def test_a_second_merge_key_is_a_duplicate():
    text = 'x-a: &a {k: 1}\nx-b: &b {l: 2}\nx-c: {<<: *a, m: 3, <<: *b}'
    (finding,) = parse(text).diagnostics
    assert (finding.rule, finding.span.line, finding.span.column) == ('duplicate-key', 3, 21)
    assert finding.help == 'merge several with <<: [*one, *two]'


def test_a_file_of_very_many_values_is_not_read():
    text = f'a: [{"1," * 150_001}]'
    assert first_line(text).endswith('the file holds more than 150,000 keys and values')
