import pytest

from composer.diagnostics import SourceFile
from composer.interfaces.definitions.statement_rules import check_statement, find_message
from composer.interfaces.definitions.statements import split_line

pytestmark = pytest.mark.ros

FAULTY = [
    ('int a', 'unknown-type', 'int', "did you mean 'int32'?"),
    ('strng a', 'unknown-type', 'strng', "did you mean 'string'?"),
    (
        'geometry_msgs/msg/Pose p',
        'bad-type',
        'geometry_msgs/msg/Pose',
        "did you mean 'geometry_msgs/Pose'?",
    ),
    ('Geometry/Pose p', 'bad-type', 'Geometry/Pose', None),
    ('int32[0] a', 'bad-type', '[0]', None),
    ('int32[<=] a', 'bad-type', '[<=]', None),
    (
        'int32[ a',
        'bad-type',
        'int32[',
        'without spaces: int32[], int32[3] or int32[<=3] for arrays, string<=10 for text',
    ),
    (
        'bool<=3 a',
        'bad-type',
        '<=3',
        'string and wstring do; the bound of an array stands inside its brackets',
    ),
    ('int32', 'missing-name', '', None),
    ('int32 maxSpeed;', 'bad-name', 'maxSpeed;', "did you mean 'max_speed'?"),
    ('int32 a__b', 'bad-name', 'a__b', "did you mean 'a_b'?"),
    ('int32 class', 'bad-name', 'class', 'call it class_value, for example'),
    ('int32 maxSpeed=3', 'bad-name', 'maxSpeed', "did you mean 'MAX_SPEED'?"),
    (
        'string text "a=b"',
        'bad-name',
        'text "a',
        'a line with = is a constant: defaults and types with spaces cannot contain one',
    ),
    ('  int32 a', 'indented-definition', '  ', "remove the 2 spaces before 'int32'"),
    ('uint8 A=256', 'bad-constant', '256', None),
    ('int32 A=', 'bad-constant', '', None),
    ('int32[] A=3', 'bad-constant', 'int32[]', None),
    ('string<=3 A=abc', 'bad-constant', 'string<=3', None),
    ('bool a maybe', 'bad-default', 'maybe', None),
    ('string<=3 a "four"', 'bad-default', '"four"', None),
    ('int32[3] a [1, 2]', 'bad-default', '[1, 2]', None),
    ('std_msgs/Header a 1', 'bad-default', '1', None),
    ('float64 a inf', 'bad-default', 'inf', None),
    ('float32 a 1e39', 'bad-default', '1e39', None),
    ('int32[] a []', 'bad-default', '[]', 'leave out the []'),
    ('string a "b\\n"', 'bad-default', '"b\\n"', None),
    ('string[] a ["é"]', 'bad-default', '["é"]', None),
]
SOUND = [
    'int32 a',
    'string<=10 name',
    'wstring<=3[<=2] names',
    'geometry_msgs/Pose[3] poses',
    'Other other',
    'uint8 RED=0x10',
    'float32 rate -1.5e3',
    'bool[2] a [1, false]',
    'string[] a ["x", \'y, z\']',
    'string EMPTY=',
    'byte a 255',
]


@pytest.mark.parametrize(('line', 'rule', 'text', 'advice'), FAULTY)
def test_a_finding_is_found_where_it_is(
    line: str,
    rule: str,
    text: str,
    advice: str | None,
) -> None:
    statement = split_line(SourceFile('Some.msg', ('', line)), 2)
    assert statement is not None
    [diagnostic] = check_statement(statement)
    assert diagnostic.span is not None
    assert (diagnostic.rule, diagnostic.span.line, diagnostic.span.text) == (rule, 2, text)
    if advice is not None:
        assert diagnostic.help == advice


@pytest.mark.parametrize('line', SOUND)
def test_a_sound_line_has_no_findings(line: str) -> None:
    statement = split_line(SourceFile('Some.msg', (line,)), 1)
    assert statement is not None
    assert list(check_statement(statement)) == []


def test_a_line_may_have_several_findings() -> None:
    statement = split_line(SourceFile('Some.msg', (' strng goodName',)), 1)
    assert statement is not None
    rules = [diagnostic.rule for diagnostic in check_statement(statement)]
    assert rules == ['indented-definition', 'unknown-type', 'bad-name']


@pytest.mark.parametrize(
    ('type_text', 'message'),
    [
        ('Point[3]', 'mine/Point'),
        ('std_msgs/Header', 'std_msgs/Header'),
        ('int32', None),
        ('string<=3', None),
        ('a/b/C', None),
        ('int32[', None),
    ],
)
def test_a_type_refers_to_a_message(type_text: str, message: str | None) -> None:
    assert find_message('mine', type_text) == message
