"""Names of modules that behaviours in several processes share in code."""

import pytest

RULE = 'shared-across-workers'
NODES = """
  writer: {worker: one, timers: {tick: {period: 1, behaviour: 'parts:write'}}}
  reader: {timers: {tick: {period: 1, behaviour: 'parts:read'}}}
"""
# The code of `parts`, and the name that only `write` changes and `read` reads.
SHARED = [
    ("STATE = {}\ndef write(node): STATE['x'] = 1\ndef read(node): return STATE['x']", 'STATE'),
    ('STATE = []\ndef write(node): STATE.append(1)\ndef read(node): return len(STATE)', 'STATE'),
    ('N = 0\ndef write(node):\n  global N\n  N += 1\ndef read(node): return N', 'N'),
    (
        'class Robot:\n  pose = None\ndef write(node): Robot.pose = 1\n'
        'def read(node): return Robot.pose',
        'Robot.pose',
    ),
    # Through functions that they call, or hand on.
    (
        "STATE = {}\ndef put(key): STATE[key] = 1\ndef write(node): put('x')\n"
        "def get(key): return STATE[key]\ndef read(node): return list(map(get, 'x'))",
        'STATE',
    ),
    (
        'import threading\nREADY = threading.Event()\ndef write(node): READY.set()\n'
        'def read(node): return READY.is_set()',
        'READY',
    ),
    ('from store import STATE\ndef write(node): STATE[1] = 1\ndef read(node): return STATE', 'STATE'),
    ('import store\ndef write(node): store.add()\ndef read(node): return store.STATE', 'STATE'),
    # By another name.
    (
        "STATE = {}\nALSO = STATE\ndef write(node):\n  mine = ALSO\n  mine['x'] = 1\n"
        "def read(node): return STATE['x']",
        'STATE',
    ),
    ('import store\ndef write(node):\n  s = store.STATE\n  s[1] = 1\ndef read(node): return store.STATE', 'STATE'),
    # Of a class, by an instance, or of its base.
]  # fmt: skip
OWN = [
    # Nobody changes it.
    "STATE = {}\ndef write(node): return STATE\ndef read(node): return STATE['x']",
    # Each process keeps its own: a memory of what was computed, a count.
    'N = 0\ndef count():\n  global N\n  N += 1\n  return N\n'
    'def write(node): count()\ndef read(node): count()',
    # What `read` has is something else.
    "STATE = {}\ndef write(node): STATE['x'] = 1\ndef read(node):\n  STATE = {}\n  return STATE",
    "STATE = {}\ndef write(node): STATE['x'] = 1\ndef read(node): return node.STATE",
    'STATE = {}\ndef write(node): STATE = 1\ndef read(node): return STATE',
    # Nobody reads it.
    "STATE = {}\ndef write(node): STATE['x'] = 1\ndef read(node): STATE.clear()",
    # Instances are made with the nodes.
    'class R:\n  def __init__(self): self.n = 0\n  def add(self): self.n += 1\n'
    'def write(node): R().add()\ndef read(node): return R().n',
    # What `write` changes may be something else, or a copy.
    "STATE = {}\ndef write(node):\n  s = STATE\n  s = {}\n  s['x'] = 1\ndef read(node): return STATE",
    "STATE = {}\ndef write(node):\n  s = dict(STATE)\n  s['x'] = 1\ndef read(node): return STATE",
    # Names that stand for each other.
    # Of Python itself.
    "import os\ndef write(node): os.environ['x'] = '1'\ndef read(node): return os.environ['x']",
]  # fmt: skip
STORE = 'STATE = {}\nCOUNT = 0\n\n\ndef add():\n    STATE[2] = 2\n'


@pytest.fixture
def find(check, tmp_path):
    """Return what is found in the two nodes, whose behaviours are in `parts`."""
    (tmp_path / 'store.py').write_text(STORE)
    (tmp_path / 'passed_on.py').write_text('from store import STATE\n')

    def find(code, nodes=NODES, before=''):
        return check(nodes, code, before=before, rule=RULE)

    return find


@pytest.mark.parametrize(('code', 'name'), SHARED)
def test_what_one_process_changes_another_one_cannot_read(find, code, name):
    (message,) = find(code)
    home = 'store' if 'store' in code or 'passed_on' in code else 'parts'
    assert message == (
        f"'parts:read' in the process of the system reads '{name}' of the module '{home}', "
        "which only 'parts:write' in worker one changes"
    )


@pytest.mark.parametrize(('code', 'name'), SHARED)
def test_in_one_process_nodes_share_it(find, code, name):
    assert find(code, NODES.replace('worker: one, ', '')) == []
    # All who read it have somebody beside them who changes it.
    beside = "  other: {timers: {tick: {period: 1, behaviour: 'parts:write'}}}\n"
    assert find(code, NODES + beside) == []
    assert name in code


@pytest.mark.parametrize('code', OWN)
def test_what_each_process_has_for_itself_is_not_shared(find, code):
    assert find(code) == []


def test_hosts_are_other_processes_too(find):
    code = SHARED[0][0]
    (message,) = find(code, NODES.replace('worker: one', 'host: jetson'))
    assert message.endswith("which only 'parts:write' on host jetson changes")
