"""Imports of what there is not are found where they stand, and no others."""

from pathlib import Path

import pytest

RULE = 'missing-module'
NODES = '  n: {on_start: parts:go}\n'
GO = '\ndef go(node): ...\n'


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Write a package with modules, and what makes this a Python that can run the system."""
    monkeypatch.chdir(tmp_path)
    files = {
        'ros/rclpy/__init__.py': '',
        'package/__init__.py': 'from . import inner\nfrom .inner import turn as twist\n',
        'package/inner.py': 'def turn(node): ...\nname = 1\n',
        'space/one.py': 'from .other import turn\n',
        'space/other.py': 'def turn(node): ...\n',
        'space/deep/__init__.py': 'from .. import one\n',
        'declared/msg/Own.msg': 'int8 x\n',
        'open.py': 'def __getattr__(name): ...\ndef turn(node): ...\n',
        'broken_chain.py': 'import package.innner\n',
        'guarded.py': 'try:\n    import not_there\nexcept ImportError: ...\n',
    }
    for name, text in files.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path / 'ros')


@pytest.mark.usefixtures('project')
@pytest.mark.parametrize(
    'code',
    [
        'import os.path, sys, time as t\nfrom collections.abc import Mapping',
        'import yaml, jinja2.sandbox\nfrom composer import Node',
        'import package\nimport package.inner\nfrom package import inner, twist',
        'from package.inner import *',
        'from space import one, deep\nimport space.deep',
        'from open import trun',
        'import guarded',
        'try:\n    import not_there\nexcept ImportError:\n    not_there = None',
        'from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import not_there',
        'from contextlib import suppress\nwith suppress(ImportError):\n    import not_there',
        'def unused(node):\n    import not_there',
        'import sys\nsys.path.insert(0, "elsewhere")\nimport not_there',
        'from declared.msg import Own',
        'class Lazy:\n    def load(self):\n        import not_there',
    ],
)
def test_imports_of_what_there_is_or_may_be_are_let_pass(check, code):
    before = 'interfaces: {declared: declared}\n'
    assert check(NODES, code + GO, before=before, rule=RULE) == []


@pytest.mark.usefixtures('project')
@pytest.mark.parametrize(
    ('code', 'message'),
    [
        ('import not_there', "there is no module 'not_there'"),
        ('from not_there import this', "there is no module 'not_there'"),
        ('import json.decode', "there is no module 'json.decode'"),
        ('from time import slep', "time has no 'slep'"),
        ('from os.path import jion', "os.path has no 'jion'"),
        ('from package.iner import turn', "there is no module 'package.iner'"),
        ('from package.inner import trun', "package.inner has no 'trun'"),
        ('from package import iner', "package has no 'iner'"),
        ('from space import two', "there is no module 'space.two'"),
        ('from . import inner', "'parts' is in no package that '.' means"),
        ('import broken_chain', "there is no module 'package.innner'"),
    ],
)
def test_what_cannot_be_imported_is_found(check, code, message):
    assert check(NODES, code + GO, rule=RULE) == [message]


@pytest.mark.ros
@pytest.mark.usefixtures('project')
@pytest.mark.parametrize(
    ('code', 'message'),
    [
        ('from std_msgs.msg import String\nimport std_msgs.msg as messages', None),
        ('from std_msgs.msg._string import String', None),
        ('from declared.msg import Own', None),
        ('from std_msgs.msg import Strin', "std_msgs.msg has no 'Strin'"),
        ('from std_msgs.srv import String', "std_msgs.srv has no 'String'"),
        ('from std_msgs.mgs import String', "there is no module 'std_msgs.mgs'"),
        ('from st_msgs.msg import String', "there is no module 'st_msgs'"),
        ('from declared.msg import Onw', "declared.msg has no 'Onw'"),
    ],
)
def test_types_are_imported_from_where_they_are(check, code, message):
    before = 'interfaces: {declared: declared}\n'
    found = check(NODES, code + GO, before=before, rule=RULE)
    assert found == ([message] if message else [])
