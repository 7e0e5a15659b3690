"""Names that modules and messages do not have are found wherever they stand."""

import pytest

NODES = '  n: {on_start: parts:go}\n'
HEAD = """
import collections, datetime, itertools as it, json, math, os, random, sys, time
import composer
import rclpy.time
import sensor_msgs.msg
from dataclasses import dataclass
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_srvs.srv import SetBool


def go(node): ...
"""
# What is wrong, the rule, and the suggestion.
WRONG = [
    ('X = math.sqr(2.0)', 'unknown-attribute', 'sqrt'),
    ('class Late:\n    def run(self): return time.now()', 'unknown-attribute', ''),
    ('X = collections.dequeue()', 'unknown-attribute', 'deque'),
    ('X = datetime.datetime.noww()', 'unknown-attribute', 'now'),
    ('X = rclpy.time.Tim', 'unknown-attribute', 'Time'),
    ('X = composer.CallTimedOutError', 'unknown-attribute', 'CallTimeoutError'),
    ('from composer import Nod', 'missing-module', 'Node'),
    ('from rclpy.time import Duraton', 'missing-module', 'Duration'),
    ('from sensor_msgs import Image', 'missing-module', 'sensor_msgs.msg'),
    ('X = sensor_msgs.Image()', 'missing-module', 'sensor_msgs.msg'),
    ('def later():\n    from std_srvs.msg import Trigger', 'missing-module', 'std_srvs.srv.Trigger'),
    ('X = {1: DiagnosticStatus.EROR}', 'unknown-field', 'ERROR'),
    ('@dataclass\nclass C:\n    fix: int = NavSatStatus.STATUS_FIXED', 'unknown-field', 'STATUS_FIX'),
    ('X = DiagnosticStatus.Ok', 'unknown-field', 'OK'),
]  # fmt: skip
RIGHT = [
    'X = math.sqrt(2.0), os.path.join("a"), os.sep, datetime.datetime.now, DiagnosticStatus.OK',
    'X = math.sumprod if hasattr(math, "sumprod") else None',
    'if sys.version_info > (3, 12):\n    X = it.batched',
    'X = sys.platform == "win32" and os.startfile',
    'try:\n    X = it.batched2\nexcept AttributeError: ...',
    'try:\n    from time import never\nexcept ImportError: ...',
    'math.extra = 1\nX = math.extra',
    'def later(math): return math.extra',
    'import json as math\nX = math.sqr',
]


def last_line(code):
    return len((HEAD + code).rstrip().splitlines())


@pytest.mark.ros
@pytest.mark.parametrize(('code', 'rule', 'meant'), WRONG)
def test_a_name_that_does_not_exist_is_found_in_its_line(check, code, rule, meant):
    assert check(NODES, HEAD + code) == [(last_line(code), rule)]
    assert f"'{meant}'" in str(check(NODES, HEAD + code, rule=rule, tells='help')) or not meant


@pytest.mark.ros
@pytest.mark.parametrize('code', RIGHT)
def test_a_name_that_exists_or_is_asked_for_first_has_no_finding(check, code):
    assert check(NODES, HEAD + code) == []
