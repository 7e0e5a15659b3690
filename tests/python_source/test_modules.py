"""Modules are read as text: what can be called is told, and nothing is run."""

import inspect
import sys
from pathlib import Path

import pytest

from composer.python_source.function_kinds import FunctionKind
from composer.python_source.module_finder import MissingModule, ModuleFinder, project_search_path
from composer.python_source.modules import ModuleSource, read_module


@pytest.fixture
def module(tmp_path):
    """Return what the text of a module says."""

    def read(text):
        path = tmp_path / 'module_under_test.py'
        path.write_text(text)
        source = read_module(path)
        assert source.syntax_error is None
        return source

    return read


def make(folder, *paths):
    for path in paths:
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text('def f(node): ...\n')


@pytest.mark.parametrize(
    ('text', 'kind'),
    [
        ('def f(): ...', FunctionKind.PLAIN),
        ('def f(): yield', FunctionKind.GENERATOR),
        ('def f():\n  for x in y:\n    if x:\n      yield x', FunctionKind.GENERATOR),
        ('async def f(): ...', FunctionKind.COROUTINE),
        ('async def f(): yield', FunctionKind.ASYNC_GENERATOR),
        ('def f():\n  def g(): yield', FunctionKind.PLAIN),
        ('def f(): return lambda: (yield)', FunctionKind.PLAIN),
        ('def f(): return (x for x in y)', FunctionKind.PLAIN),
        ('@decorator\ndef f(): yield', None),
        ('f = lambda: None', None),
        ('class f: ...', None),
        ('f = factory()', None),
        ('f, g = factory()', None),
    ],
)
def test_the_kind_of_a_function_is_told_where_it_can_be(module, text, kind):
    source = module(text)
    assert source.functions['f'].kind is kind
    assert source.constants.get('f') is None


@pytest.mark.parametrize(
    'signature',
    [
        '()',
        '(node)',
        '(node, message)',
        '(node, /, message)',
        '(node, *, speed)',
        '(node, speed=..., *, heading=...)',
        '(*args, **kwargs)',
        '(a, /, b, c=..., *args, d, e=..., **kwargs)',
        "(node: 'Node', speed: 'float | None' = ...)",
        "(*args: 'int', **kwargs: 'str')",
    ],
)
def test_the_signature_of_a_function_is_told(module, signature):
    shown = signature.replace("'", '')
    source = module(f'def f{shown}: return None')
    assert str(source.functions['f'].signature).replace('Ellipsis', '...') == signature


def test_the_signature_is_that_of_the_function_itself(module):
    text = 'def f(a, b=1, /, c=2, *d, e, g=3, **h): ...\n'
    told = module(text).functions['f'].signature
    names = {}
    exec(text, names)  # the function of this test's own text
    real = inspect.signature(names['f'])
    assert [(p.name, p.kind, p.default is p.empty) for p in told.parameters.values()] == [
        (p.name, p.kind, p.default is p.empty) for p in real.parameters.values()
    ]


@pytest.mark.parametrize(
    ('text', 'what'),
    [
        ('X = 3', 'the int 3'),
        ("X = 'a'", "the str 'a'"),
        ('X: float = 1.5', 'the float 1.5'),
        ('import X', 'a module'),
        ('import X.y', 'a module'),
        ('import y.z as X', 'a module'),
        ('def X(): ...\nX = 3', 'the int 3'),
    ],
)
def test_what_cannot_be_called_is_told(module, text, what):
    source = module(text)
    assert source.constants == {'X': what}
    assert 'X' not in source.functions


def test_a_function_may_follow_a_constant_of_its_name(module):
    source = module('f = None\ndef f(node): ...\n')
    assert source.constants == {}
    assert source.functions['f'].kind is FunctionKind.PLAIN


def test_an_annotation_alone_is_no_name(module):
    assert module('f: int').functions == {}


@pytest.mark.parametrize(
    'text',
    [
        'if x:\n  def f(node): ...',
        'try: ...\nexcept E:\n  def f(node): ...',
        'try: ...\nfinally:\n  def f(node): ...',
        'with x:\n  def f(node): ...',
        'for x in y:\n  def f(node): ...',
        'match x:\n  case 1:\n    def f(node): ...',
    ],
)
def test_conditional_definitions_are_found(module, text):
    assert str(module(text).functions['f'].signature) == '(node)'


@pytest.mark.parametrize(
    'text',
    [
        'if x:\n  def f(node): ...\nelse:\n  def f(node, more): ...',
        'try:\n  from fast import f\nexcept ImportError:\n  def f(node, more): ...',
        'try:\n  from fast import f\nexcept ImportError:\n  f = None',
        'try:\n  def f(node): ...\nexcept ImportError:\n  f = None',
        'def f(node, more): ...\nif x:\n  f = None',
        'f = None\nif x:\n  def f(node, more): ...',
    ],
)
def test_of_what_may_be_either_nothing_is_told(module, text):
    source = module(text)
    assert source.constants == {}
    assert source.functions['f'].signature is None
    assert source.functions['f'].kind is None


def test_a_definition_after_the_condition_is_the_one_that_counts(module):
    source = module('if x:\n  def f(a): ...\nelse:\n  f = None\ndef f(node): yield\n')
    assert source.functions['f'].kind is FunctionKind.GENERATOR
    assert source.constants == {}


@pytest.mark.parametrize(
    ('text', 'is_open'),
    [
        ('from other import *', True),
        ('if x:\n  from other import *', True),
        ('def __getattr__(name): ...', True),
        ('from other import thing', False),
        ('', False),
    ],
)
def test_a_module_may_have_names_that_its_text_does_not_tell(module, text, is_open):
    assert module(text).is_open is is_open


@pytest.mark.parametrize(
    ('content', 'line'),
    [
        (b'def f(:\n', ':1: '),
        (b'x = 1\nreturn x\n', ':2: '),
        (b'def f(a, a): ...\n', ':1: '),
        (b'\n\nawait x\n', ':3: '),
        (b'def f():\n\tif x:\n        y\n', ':3: '),
        (b'x = "\xff"\n', ''),
        (b'a\0b', ''),
        (b'(' * 5000, ''),
        (b'-' * 99_000 + b'1', ''),
        (b'# coding: nonsense\n', ''),
    ],
)
def test_what_is_not_python_says_where(tmp_path, content, line):
    path = tmp_path / 'broken.py'
    path.write_bytes(content)
    source = read_module(path)
    assert source.syntax_error.startswith(f'{path}{line}')
    assert source.functions == {}


def test_an_unreadable_module_says_why(tmp_path):
    source = read_module(tmp_path / 'gone.py')
    assert (
        source.syntax_error
        == f'{tmp_path}/gone.py: cannot read the file: No such file or directory'
    )


def test_other_encodings_are_read(tmp_path):
    path = tmp_path / 'latin.py'
    path.write_bytes('# coding: latin-1\ndef café(node): ...\n'.encode('latin-1'))
    assert list(read_module(path).functions) == ['café']


def test_nothing_of_a_module_is_run(tmp_path):
    (tmp_path / 'package').mkdir()
    text = "open({!r}, 'w')\nimport subprocess_of_nobody\nraise SystemExit\ndef f(node): ...\n"
    for name in ('__init__', 'module'):
        trace = str(tmp_path / f'{name}.ran')
        (tmp_path / 'package' / f'{name}.py').write_text(text.format(trace))
    before = set(sys.modules)
    source = ModuleFinder([tmp_path]).find('package.module')
    assert list(source.functions) == ['f']
    assert list(tmp_path.glob('*.ran')) == []
    assert set(sys.modules) == before
    assert list(tmp_path.rglob('__pycache__')) == []


def test_modules_are_found_as_python_finds_them(tmp_path):
    make(tmp_path, 'alone.py', 'package/__init__.py', 'package/inner.py', 'package/sub/deep.py')
    finder = ModuleFinder([tmp_path])
    for name, path in {
        'alone': 'alone.py',
        'package': 'package/__init__.py',
        'package.inner': 'package/inner.py',
        'package.sub.deep': 'package/sub/deep.py',
    }.items():
        assert finder.find(name).path == tmp_path / path
    assert finder.find('package.sub').path is None


def test_namespace_packages_lie_side_by_side(tmp_path):
    make(tmp_path, 'one/shared/a.py', 'two/shared/b.py', 'two/shared/a.py')
    finder = ModuleFinder([tmp_path / 'one', tmp_path / 'two'])
    assert finder.find('shared.a').path == tmp_path / 'one/shared/a.py'
    assert finder.find('shared.b').path == tmp_path / 'two/shared/b.py'


def test_a_regular_package_hides_the_portions_behind_it(tmp_path):
    make(tmp_path, 'one/shared/__init__.py', 'two/shared/b.py')
    finder = ModuleFinder([tmp_path / 'one', tmp_path / 'two'])
    package = tmp_path / 'one/shared/__init__.py'
    assert finder.find('shared.b') == MissingModule('shared.b', None, package)


def test_a_users_behaviours_lie_beside_the_shipped_ones(tmp_path):
    make(tmp_path, 'behaviours/mine.py')
    finder = ModuleFinder([tmp_path])
    assert finder.find('behaviours.mine').path == tmp_path / 'behaviours' / 'mine.py'
    assert 'say_name' in finder.find('behaviours.greeter').functions


@pytest.mark.parametrize(
    'name', ['json', 'json.decoder', 'sys', 'math', 'yaml', 'collections.abc']
)
def test_installed_modules_are_found(name):
    assert isinstance(ModuleFinder([]).find(name), ModuleSource)


@pytest.mark.parametrize('name', ['sys', 'time'])
def test_what_has_no_source_may_have_any_name(name):
    assert ModuleFinder([]).find(name).is_open


def test_a_missing_module_says_which_part_and_what_is_near(tmp_path):
    make(tmp_path, 'motion/drive.py', 'motion/steer.py')
    finder = ModuleFinder([tmp_path])
    assert finder.find('motoin.drive') == MissingModule('motoin', 'motion')
    assert finder.find('motion.drve') == MissingModule('motion.drve', 'motion.drive')
    assert finder.find('motion.drive.wheel') == MissingModule('motion.drive.wheel', None)
    assert finder.find('zzqqxx.yy') == MissingModule('zzqqxx', None)


def test_a_project_reaches_up_to_its_mark(tmp_path, monkeypatch):
    monkeypatch.chdir('/')
    folder = tmp_path / 'project' / 'systems' / 'deep'
    folder.mkdir(parents=True)
    assert project_search_path([folder / 'a.yaml']) == [Path('/'), folder]
    (tmp_path / 'project' / 'pyproject.toml').touch()
    assert project_search_path([folder / 'a.yaml']) == [
        Path('/'), folder, folder.parent, folder.parent.parent
    ]  # fmt: skip
    (tmp_path / 'project' / 'systems' / '.git').mkdir()
    assert project_search_path([folder / 'a.yaml']) == [Path('/'), folder, folder.parent]


def test_the_folder_of_the_command_comes_first(tmp_path, monkeypatch):
    make(tmp_path, 'here/f.py', 'there/f.py')
    monkeypatch.chdir(tmp_path / 'here')
    path = project_search_path([tmp_path / 'there' / 'a.yaml'])
    assert path == [tmp_path / 'here', tmp_path / 'there']
    assert ModuleFinder(path).find('f').path == tmp_path / 'here' / 'f.py'


def test_modules_are_read_until_they_are_too_many(tmp_path):
    for name in 'ab':
        (tmp_path / f'{name}.py').write_text('def f(node): ...\n')
    finder = ModuleFinder([tmp_path])
    finder._tokens_left = 15
    assert finder.find('a').unread is None
    assert (
        finder.find('b').unread
        == f'{tmp_path}/b.py and the modules before it are too many to be read'
    )


def test_a_module_is_read_again_only_if_its_source_differs(tmp_path, monkeypatch):
    make(tmp_path, 'parts.py', 'rest.py')
    path = project_search_path([tmp_path / 'system.yaml'])
    before = ModuleFinder(path)
    same, other = before.find('parts'), before.find('rest')
    (tmp_path / 'rest.py').write_text('def g(node): ...\n')
    after = ModuleFinder(path, before)
    assert after.find('parts') is same
    assert after.find('rest') is not other
    assert [*after.find('rest').functions] == ['g']
    # Its name is relative to the current folder.
    monkeypatch.chdir(tmp_path)
    here = project_search_path([tmp_path / 'system.yaml'])
    assert ModuleFinder(here, after).find('parts') is not same


def test_a_form_feed_ends_no_line(tmp_path):
    path = tmp_path / 'module.py'
    path.write_bytes(b'a = 1\r\n\x0cb = 2\nc = 3\n')
    module = read_module(path)
    assert module.lines == ('a = 1', '\x0cb = 2', 'c = 3')
    assert [each.lineno for each in module.body] == [1, 2, 3]
