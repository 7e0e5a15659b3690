"""A small system whose behaviour a parameter chooses, and scenarios of it."""

import json
from textwrap import dedent, indent

import pytest

from composer.cli.main import run

SYSTEM = """
    version: 1
    nodes:
      worker:
        parameters: {mode: works}
        state: {count: 0}
        publishers: {out: std_msgs/msg/Int64}
        timers: {tick: {period: 0.5, behaviour: 'parts:tick', publish: out}}
      hearer:
        subscriptions: {out: {type: std_msgs/msg/Int64, behaviour: 'parts:hear'}}
"""
CODE = """
    import ctypes
    import os
    import signal
    import threading
    import time

    def tick(node):
        node.state.count += 1
        if node.state.count == 3:
            globals()[node.parameters.mode](node)
        return node.state.count

    def hear(node, message):
        node.logger.info(f'heard {message.data}')

    def works(node):
        print('this was printed')

    def fails(node):
        raise ValueError('planned')

    def crashes(node):
        ctypes.string_at(0)

    def exits(node):
        os._exit(7)

    def loops(node):
        while node.state.count:
            pass

    def blocks(node):
        ctypes.PyDLL(None).sleep(1000)

    def reads_real_time(node):
        time.process_time()
"""


class Project:
    """A folder with a system, and the scenarios that a test adds."""

    def __init__(self, folder):
        self.folder = folder
        self.write('system.yaml', SYSTEM)
        self.write('parts.py', CODE)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(text))

    def scenario(self, cases, name='tests/worker'):
        head = 'version: 1\nsystem: {file: ../system.yaml}\nuntil: 3\ncases:\n'
        self.write(f'{name}.scenario.yaml', head)
        with (self.folder / f'{name}.scenario.yaml').open('a') as file:
            file.write(indent(dedent(cases), '  '))


@pytest.fixture
def project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return Project(tmp_path)


@pytest.fixture
def run_json(capsys):
    """Run `composer test` and return its exit code and its report."""

    def run_it(*words):
        code = run(['test', '--format', 'json', *words])
        return code, json.loads(capsys.readouterr().out)

    return run_it
