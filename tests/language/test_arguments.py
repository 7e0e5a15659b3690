"""What a file takes from the command line: declarations, and the words that give values."""

import pytest

from composer.errors import UsageError
from composer.language.arguments import describe_arguments
from composer.language.pipeline import load_system_text

ARGUMENTS = """
version: 1
args:
  name: {type: string, description: Whose it is.}
  count: {default: 3}
  rate: {type: double, default: 1}
  loud: {default: false, description: Whether it shouts.}
  mode: {default: "", choices: ["", fast, "very slow"]}
nodes: {}


"""

DECLARED = """the file declares
  name (string, required): Whose it is.
  count (integer, default 3)
  rate (double, default 1.0)
  loud (bool, default false): Whether it shouts.
  mode (string, one of '', fast, very slow, default '')"""


def values(*words, text=ARGUMENTS):
    """Return the values of the arguments, as state of a node that is made of them."""
    declared = load_system_text(text).arguments
    state = ', '.join(f'{name}: "{{{{ {name} }}}}"' for name in declared)
    text = text.replace('nodes: {}', f'nodes: {{n: {{state: {{{state}}}}}}}')
    loaded = load_system_text(text, words=words)
    assert loaded.diagnostics == []
    return dict(loaded.spec.nodes['n'].state)


def refusal(*words, text=ARGUMENTS):
    with pytest.raises(UsageError) as caught:
        load_system_text(text, words=words)
    return str(caught.value)


DEFAULTS = {'name': 'a', 'count': 3, 'rate': 1.0, 'loud': False, 'mode': ''}


@pytest.mark.parametrize(
    ('words', 'changes'),
    [
        (['a'], {}),
        (
            ['b', '7', '0.5', 'true', 'fast'],
            {'name': 'b', 'count': 7, 'rate': 0.5, 'loud': True, 'mode': 'fast'},
        ),
        (['mode:=very slow', 'a', '5'], {'mode': 'very slow', 'count': 5}),
        (['a', 'mode:='], {}),
        (['', '-7', '-1e3'], {'name': '', 'count': -7, 'rate': -1000.0}),
        (['a', 'count:=0x10'], {'count': 16}),
        (['true'], {'name': 'true'}),
        (['name:=x:=y'], {'name': 'x:=y'}),
    ],
)
def test_words_give_values_by_name_or_in_the_order_of_the_declarations(words, changes):
    found = values(*words)
    assert found == DEFAULTS | changes
    assert [type(value) for value in found.values()] == [str, int, float, bool, str]


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        ([], "'name' is missing"),
        (['a', 'cuont:=3'], "there is no argument 'cuont' (did you mean 'count'?)"),
        (['a', 'name:=b'], "'name' is given twice: 'a' and 'b'"),
        (['a', '3', '1', 'true', 'fast', 'x', '-1'],
         "'x' is one argument too many; '-1' is one argument too many"),
        (['a', 'three'], "'count': expected an integer, got 'three'"),
        (['a', '3.0'], "'count': expected an integer, got 3.0"),
        (['a', 'null'], "'count': expected an integer, got 'null'"),
        (['a', '9223372036854775808'], "'count': 9223372036854775808 does not fit in 64 bits"),
        (['a', 'loud:=yes'], "'loud': expected a bool, got 'yes' (write true)"),
        (['a', 'mode:=slow'], "'mode': 'slow' is not one of '', fast, very slow"),
    ],
)  # fmt: skip
def test_words_that_do_not_fit_are_refused(words, message):
    assert refusal(*words) == message


def test_all_that_is_wrong_is_one_error_that_shows_what_is_declared():
    with pytest.raises(UsageError) as caught:
        load_system_text(ARGUMENTS, words=['cuont:=3', 'rate:=fast', 'loud:=true', 'loud:=false'])
    assert str(caught.value) == (
        "there is no argument 'cuont' (did you mean 'count'?); "
        "'loud' is given twice: 'true' and 'false'; "
        "'name' is missing; "
        "'rate': expected a double, got 'fast'"
    )
    assert caught.value.help == DECLARED


def test_a_file_without_arguments_takes_no_words():
    text = 'version: 1\nnodes: {}'
    assert refusal('a:=1', '3', text=text) == (
        "there is no argument 'a'; '3' is one argument too many"
    )


def test_a_file_without_arguments_says_so():
    assert describe_arguments({}) == 'the file declares no arguments'


@pytest.mark.parametrize(
    'block', ['args: 3', 'args: [a]', 'args: {{a}: 1}', 'args: {: 1}', 'args:']
)
def test_a_block_that_is_no_mapping_of_names_is_said(block):
    loaded = load_system_text(f'version: 1\n{block}\nnodes: {{}}\n', words=[])
    assert len(loaded.diagnostics) == 1
    assert loaded.diagnostics[0].span.line == 2


@pytest.mark.parametrize('name', ['args', 'input/cloud', 'a.b-c/d'])
def test_expressions_read_any_name_from_args(name):
    text = f"""version: 1
args: {{'{name}': {{default: x}}, other: "{{{{ args['{name}'] }}}}_y"}}
processes: {{p: {{command: [echo, "{{{{ args['{name}'] }}}}", "{{{{ other }}}}"]}}}}
"""
    for words, expected in (([], 'x'), ([f'{name}:=z'], 'z')):
        system = load_system_text(text, words=words)
        assert not system.diagnostics
        assert system.spec.processes['p'].command == ('echo', expected, f'{expected}_y')
