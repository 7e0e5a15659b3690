"""A name is defined by the functions around it and by the top of the module, not by others."""

import pytest

NODES = '  n:\n    on_start: parts:Guard.on_start\n'
CODE = """
import math
try:
    import numpy
except ImportError:
    numpy = None

class Guard:
    limit = 1.0

    def __init__(self, node):
        self.speed = 1.0

    def stop(self): pass

    def on_start(self, node):
        count = 1
        total: Missing = 1
        {line}

def other(message):
    global shared
    shared = zzz = message
"""
WRONG = {
    'stop()': 'write self.stop',
    'print(speed)': None,
    'print(message)': None,
    'print(zzz)': None,
    'print(limits)': None,
    'print(cuont)': "did you mean 'count'?",
    'def wait(): print(node.name, nod)': "did you mean 'node'?",
    'self.stop(); print(Missing)': None,
}
RIGHT = [
    'print(numpy, shared, math, Guard, other, count, print)',
    'def wait(): return count + later\n        later = [each for each in [1]]; wait()',
    'print([(lambda a, *b, c=1, **d: (a, b, c, d))(each) for each in [1] if (kept := each)], kept)',
    'class Inner:\n            x = 1; y = x\n            def get(self): return x',
    'for i, (a, *b) in [(1, [2])]: print(i, a, b)',
    'with open("a") as file: print(file)',
    'try: pass\n        except OSError as error: print(error)',
    'match count:\n            case [a, *b] | {"c": a, **b}: print(a, b)\n            case _: print(_)',
    'exec("undefined = 1"); print(undefined)',
]


@pytest.mark.parametrize(('line', 'advice'), WRONG.items(), ids=WRONG)
def test_a_name_of_another_function_or_of_the_class_is_undefined(check, line, advice):
    code = CODE.format(line=line)
    assert check(NODES, code, installed=False) == [(19, 'undefined-name')]
    assert check(NODES, code, installed=False, rule='undefined-name', tells='help') == [advice]


@pytest.mark.parametrize('line', RIGHT)
def test_a_name_that_may_be_defined_has_no_finding(check, line):
    assert check(NODES, CODE.format(line=line), installed=False) == []


def test_a_node_that_is_not_passed_on_is_undefined(check):
    code = 'def hear(node): send()\n\ndef send(): node.publish("a", 1)\n'
    nodes = '  n: {on_start: parts:hear}\n'
    found = check(nodes, code, installed=False, rule='undefined-name', tells='help')
    assert found == ['take node as a parameter']
