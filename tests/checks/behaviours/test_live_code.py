"""What is filled or set by calls that the check does not follow is not taken for empty or unset."""

import re

import pytest

SYSTEM = """
  rover:
    parameters: {speed: 1.0}
    publishers: {level: {type: std_msgs/msg/UInt8, external: true}}
    subscriptions:
      odom: {type: nav_msgs/msg/Odometry, external: true, behaviour: parts:hear}
      joy: {type: sensor_msgs/msg/Joy, external: true, behaviour: parts:other}
"""
OBJECT = SYSTEM.replace('parts:hear', "'parts:Rover.hear'").replace(
    'parts:other', "'parts:Rover.other'"
)
HEAD = """
import importlib, contextlib, functools, heapq, itertools, operator, random, threading, bisect, copy, sys, array, atexit, types, weakref, concurrent.futures
import collections, dataclasses, enum
from collections import ChainMap, Counter, OrderedDict, UserDict, UserList, defaultdict, deque
import numpy as np
vendor = importlib.import_module('vendor')
"""
OTHER = """
def other(node, m):
    pass
"""
# What a function has before it goes on; GO stands for what is reached.
IN_FUNCTION = {
    'a helper': 'l = []\nvendor.fill(l)\nif not l: return',
    'a bound method in a variable': 'l = []\nadd = l.append\nvendor.each(add)\nif not l: return',
    'a partial': 'l = []\nvendor.each(functools.partial(l.append, 1))\nif not l: return',
    'a partial of a partial': 'l = []\np = functools.partial(functools.partial(list.append, l))\nvendor.run(p)\nif not l: return',
    'map': 'l = []\nlist(map(l.append, m.header.frame_id))\nif not l: return',
    'map of known items': "l = []\ndeque(map(l.append, 'ab'), maxlen=0)\nif not l: return",
    'iter until a value': 'l = []\nfor x in iter(lambda: l.append(1), None): break\nif not l: return',
    'heappush': 'l = []\nheapq.heappush(l, 1)\nif not l: return',
    'insort': 'l = []\nbisect.insort(l, 1)\nif not l: return',
    'setitem': "d = {}\noperator.setitem(d, 'a', 1)\nif not d: return",
    'iadd': 'l = []\noperator.iadd(l, [1])\nif not l: return',
    'reduce': 'l = []\nfunctools.reduce(lambda a, x: a.append(x) or a, m.pose.covariance, l)\nif not l: return',
    'a timer': 'l = []\nt = threading.Timer(0.1, l.append, (1,))\nt.start()\nt.join()\nif not l: return',
    'a thread': 'l = []\nt = threading.Thread(target=l.append, args=(1,))\nt.start()\nt.join()\nif not l: return',
    'a thread with a closure': 'l = []\ndef work():\n    l.append(1)\nt = threading.Thread(target=work)\nt.start()\nt.join()\nif not l: return',
    'list.append': 'l = []\nlist.append(l, 1)\nif not l: return',
    'dict.update': 'd = {}\ndict.update(d, a=1)\nif not d: return',
    'dict.setdefault': "d = {}\ndict.setdefault(d, 'a', 1)\nif len(d) == 0: return",
    'set.add': 's = set()\nset.add(s, 1)\nif not s: return',
    'methodcaller': "l = []\noperator.methodcaller('append', 1)(l)\nif not l: return",
    'getattr': "l = []\ngetattr(l, 'append')(1)\nif not l: return",
    'getattr with a name': 'l = []\ngetattr(l, m.header.frame_id)(1)\nif not l: return',
    'a deque': 'd = deque()\nvendor.fill(d)\nif not d: return',
    'a Counter': 'c = Counter()\nc.update(m.header.frame_id)\nif not c: return',
    'a Counter elsewhere': 'c = Counter()\nvendor.fill(c)\nif not c: return',
    'a defaultdict': 'd = defaultdict(list)\nd[m.header.frame_id].append(1)\nif not d: return',
    'an array': "a = array.array('d')\nvendor.fill(a)\nif not a: return",
    'a bytearray': 'b = bytearray()\nvendor.fill(b)\nif not b: return',
    'bytearray extend': "b = bytearray()\nb.extend(b'x')\nif not b: return",
    'a NumPy array': 'a = np.zeros(3)\nvendor.fill(a)\nif not a.any(): return',
    'a UserList': 'l = UserList()\nl.append(1)\nif not l: return',
    'a UserDict': "d = UserDict()\nd['a'] = 1\nif not d: return",
    'an OrderedDict': 'd = OrderedDict()\nvendor.fill(d)\nif not d: return',
    'in a list': 'l = []\nbox = [l]\nvendor.fill(box)\nif not l: return',
    'in a dict': "l = []\nvendor.fill({'a': l})\nif not l: return",
    'in a tuple in a dict': "l = []\nvendor.fill({'a': (1, l)})\nif not l: return",
    'in an object': 'class Box: pass\nl = []\nb = Box()\nb.l = l\nvendor.fill(b)\nif not l: return',
    'in an object in an object': 'class Box: pass\nl = []\nb, c = Box(), Box()\nb.l, c.b = l, b\nvendor.fill(c)\nif not l: return',
    'an attribute': 'class Box:\n    def __init__(self): self.l = []\nb = Box()\nvendor.fill(b)\nif not b.l: return',
    'a flag of an object': 'class Box:\n    ready = False\nb = Box()\nvendor.fill(b)\nif not b.ready: return',
    'None of an object': 'class Box:\n    def __init__(self): self.link = None\nb = Box()\nvendor.connect(b)\nif b.link is None: return',
    'a bound method of an object': 'class Box:\n    def __init__(self): self.l = []\n    def add(self, x): self.l.append(x)\nb = Box()\nvendor.run(b.add)\nif not b.l: return',
    'a namespace': 'b = types.SimpleNamespace(ready=False)\nvendor.fill(b)\nif not b.ready: return',
    'vars of a namespace': "b = types.SimpleNamespace(ready=False)\nvars(b)['ready'] = True\nif not b.ready: return",
    'vars': "class Box:\n    def __init__(self): self.ready = False\nb = Box()\nvars(b)['ready'] = True\nif not b.ready: return",
    'vars update': 'class Box:\n    def __init__(self): self.ready = False\nb = Box()\nvars(b).update(ready=True)\nif not b.ready: return',
    '__dict__': "class Box:\n    def __init__(self): self.ready = False\nb = Box()\nb.__dict__['ready'] = True\nif not b.ready: return",
    '__dict__ update': 'class Box:\n    def __init__(self): self.ready = False\nb = Box()\nb.__dict__.update(ready=True)\nif not b.ready: return',
    'setattr': "class Box:\n    def __init__(self): self.ready = False\nb = Box()\nsetattr(b, 'ready', True)\nif not b.ready: return",
    'setattr with a name': 'class Box:\n    def __init__(self): self.ready = False\nb = Box()\nsetattr(b, m.header.frame_id, True)\nif not b.ready: return',
    '__setattr__': "class Box:\n    def __init__(self): self.ready = False\nb = Box()\nb.__setattr__('ready', True)\nif not b.ready: return",
    'object.__setattr__': "@dataclasses.dataclass(frozen=True)\nclass Box:\n    ready: bool = False\nb = Box()\nobject.__setattr__(b, 'ready', True)\nif not b.ready: return",
    'a dataclass': '@dataclasses.dataclass\nclass Box:\n    l: list = dataclasses.field(default_factory=list)\nb = Box()\nvendor.fill(b)\nif not b.l: return',
    'a field of a dataclass': '@dataclasses.dataclass\nclass Box:\n    l: list = dataclasses.field(default_factory=list)\nb = Box()\nvendor.fill(b.l)\nif not b.l: return',
    'a method of a base that is not known': 'class Box(vendor.Base):\n    def __init__(self): self.ready = False\nb = Box()\nb.load()\nif not b.ready: return',
    'super of a base that is not known': 'class Box(vendor.Base):\n    def __init__(self):\n        self.ready = False\n        super().load()\nb = Box()\nif not b.ready: return',
    'a closure': 'l = []\ndef add(x): l.append(x)\nvendor.run(add)\nif not l: return',
    'a closure called before': 'l = []\ndef add(x): l.append(x)\nadd(1)\nvendor.run(add)\nif len(l) == 1: return',
    'a closure called twice': 'l = []\ndef add(): l.append(1)\nadd()\nadd()\nif len(l) < 2: return',
    'a lambda': 'l = []\nvendor.run(lambda: l.append(1))\nif not l: return',
    'a default': 'def add(x, l=[]):\n    l.append(x)\n    return l\nadd(1)\nif len(add(1)) == 1: return',
    'nonlocal': 'ready = False\ndef go():\n    nonlocal ready\n    ready = True\nvendor.run(go)\nif not ready: return',
    'a counter of a closure': 'n = [0]\ndef go(): n[0] += 1\nvendor.run(go)\nif n[0] == 0: return',
    'a flag in a dict': "d = {'ready': False}\nvendor.run(d)\nif not d['ready']: return",
    'a flag in a dict by a closure': "d = {'ready': False}\ndef go(): d['ready'] = True\nvendor.run(go)\nif not d['ready']: return",
    'a flag in a dict by __setitem__': "d = {'ready': False}\nvendor.run(functools.partial(d.__setitem__, 'ready', True))\nif not d['ready']: return",
    '__setitem__': "d = {}\nd.__setitem__('a', 1)\nif 'a' not in d: return",
    '__iadd__': 'l = []\nl.__iadd__([1])\nif not l: return',
    'a slice': 'l = []\nl[:] = m.pose.covariance\nif not l: return',
    'a slice of known items': 'l = []\nl[len(l):] = [1]\nif not l: return',
    'star': 'l = []\nl = [*l, *vendor.items()]\nif not l: return',
    'unpacked': 'a, *l = vendor.items()\nif not l: return',
    'walrus in a generator': 'ready = False\nany((ready := x) for x in vendor.items())\nif not ready: return',
    'walrus in a comprehension': 'ready = None\n[ready := 1 for x in m.header.frame_id]\nif ready is not None: return',
    'walrus in a choice': 'ready = False\nx = (ready := True) if m.header.frame_id else None\nif not ready: return',
    'a comprehension': 'l = []\n[l.append(x) for x in vendor.items()]\nif not l: return',
    'a comprehension with a condition': 'l = []\n[l.append(x) for x in (1, 2) if vendor.has(x)]\nif l: return',
    'a context manager': 'l = []\nwith vendor.filling(l): pass\nif not l: return',
    'a context manager by a generator': '@contextlib.contextmanager\ndef filling(l):\n    yield\n    l.append(1)\nl = []\nwith filling(l): pass\nif not l: return',
    'an exit stack': 'l = []\nwith contextlib.ExitStack() as s: s.callback(l.append, 1)\nif not l: return',
    'a with target': 'l = []\nwith vendor.open() as l: pass\nif not l: return',
    'what a match captures': "l = []\nmatch {'a': l}:\n    case {'a': x}: vendor.fill(x)\nif not l: return",
    'a match of an object': '@dataclasses.dataclass\nclass Box:\n    l: list\nl = []\nmatch Box(l):\n    case Box(x): vendor.fill(x)\nif not l: return',
    'a for target': 'l = []\nfor x in [l]: vendor.fill(x)\nif not l: return',
    'an alias': 'l = []\nk = l\nvendor.fill(k)\nif not l: return',
    'a copy that is none': 'l = [[]]\nk = copy.copy(l)\nvendor.fill(k[0])\nif not l[0]: return',
    'a view': "d = {}\nv = d.values()\nd['a'] = 1\nif not v: return",
    'a proxy': "d = {}\np = types.MappingProxyType(d)\nd['a'] = 1\nif not p: return",
    'a ChainMap': "d = {}\nc = ChainMap(d)\nd['a'] = 1\nif not c: return",
    'written through a ChainMap': "d = {}\nc = ChainMap(d)\nc['a'] = 1\nif not d: return",
    'exec': "l = []\nexec('l.append(1)')\nif not l: return",
    'eval': "l = []\neval('l.append(1)')\nif not l: return",
    'locals': 'l = []\nvendor.fill(locals())\nif not l: return',
    'stored somewhere': 'l = []\nvendor.items = l\nvendor.fill()\nif not l: return',
    'stored in an item': "l = []\nvendor.table['x'] = l\nvendor.fill()\nif not l: return",
    'stored in the state': 'l = []\nnode.state.l = l\nvendor.fill(node)\nif not l: return',
    'read out of something': 'l = vendor.items\nif not l: return',
    'an iterator': 'l = []\nit = iter(vendor.read, None)\nl.extend(it)\nif not l: return',
    'try': 'l = []\ntry:\n    vendor.risk()\n    l.append(1)\nexcept OSError: pass\nif l: return',
    'a flag in try': "d = {}\ntry:\n    vendor.risk()\n    d['a'] = 1\nexcept OSError: pass\nif 'a' in d: return",
    'on a condition': "d = {}\nif m.header.frame_id: d['a'] = 1\nif 'a' in d: return",
    'the length on a condition': "d = {}\nif m.header.frame_id: d['a'] = 1\nif d: return",
    'a flag on a condition': 'class Box:\n    ready = False\nb = Box()\nif m.header.frame_id: b.ready = True\nif b.ready: return',
    'a generator that is not begun': 'l = []\ndef go():\n    l.append(1)\n    yield\ng = go()\nif l: return',
    'a coroutine that is not awaited': 'l = []\nasync def go(): l.append(1)\nc = go()\nvendor.skip(c)\nif l: return',
    'yielded to a caller': 'def go():\n    l = []\n    yield l\n    if not l: return\n    GO\nfor x in go(): vendor.fill(x)\nreturn',
    'a decorator': 'l = []\n@vendor.each\ndef add(x): l.append(x)\nif not l: return',
    'a callback': 'l = []\nnode.create_timer(1.0, lambda node: l.append(1))\nvendor.wait()\nif not l: return',
    'a callback of rclpy': 'l = []\nnode.ros.create_timer(1.0, lambda: l.append(1))\nvendor.wait()\nif not l: return',
    'a future': 'l = []\nf = concurrent.futures.Future()\nf.add_done_callback(l.append)\nif not l: return',
    'an executor': 'l = []\nwith concurrent.futures.ThreadPoolExecutor() as pool: pool.submit(l.append, 1)\nif not l: return',
    'an executor that maps': 'l = []\nwith concurrent.futures.ThreadPoolExecutor() as pool: pool.map(l.append, [1])\nif not l: return',
    'a weak callback': 'l = []\nweakref.finalize(m, l.append, 1)\nif not l: return',
    'a class': 'l = []\nclass Box:\n    def go(self): l.append(1)\nvendor.make(Box)\nif not l: return',
    'sorted by a key': 'l = []\nsorted(m.header.frame_id, key=l.append)\nif not l: return',
    'filtered': 'l = []\nlist(filter(l.append, m.header.frame_id))\nif not l: return',
    'starmap': 'd = {}\nlist(itertools.starmap(d.__setitem__, vendor.pairs()))\nif not d: return',
    'a conditional call': 'l = []\nm.header.frame_id and l.append(1)\nif l: return',
    'a queue': 'q = vendor.Queue()\nif q.empty(): return',
    'cleared elsewhere': 'l = [1]\nvendor.clear(l)\nif l: return',
    'cleared by a method': 'l = [1]\nl.clear()\nif l: return',
    'popped elsewhere': "d = {'a': 1}\nvendor.clear(d)\nif 'a' in d: return",
    'shuffled': "l = ['a', 'b']\nrandom.shuffle(l)\nif l[0] == 'a': return",
    'a loop of while': 'l = []\nwhile not l: vendor.fill(l)\nif not l: return',
    'while it is not empty': 'l = [1]\nvendor.fill(l)\nwhile l: l.pop()\nif l: return',
    'deleted': 'l = [1]\ndel l[:]\nif l: return',
    'inherited from list': 'class Stack(list): pass\ns = Stack()\ns.append(1)\nif not s: return',
    'inherited from dict': "class Table(dict): pass\ns = Table()\ns['a'] = 1\nif not s: return",
    'times': 'l = [[]] * 3\nl[0].append(1)\nif not l[1]: return',
    'fromkeys': "d = dict.fromkeys('ab', [])\nd['a'].append(1)\nif not d['b']: return",
    'setdefault': "d = {}\nd.setdefault('a', []).append(1)\nif not d['a']: return",
    'appended to the first': 'l = [[]]\nl[0].append(1)\nif not l[0]: return',
    'a message that holds it': 'l = []\nmsg = vendor.Message()\nmsg.data = l\nmsg.fill()\nif not l: return',
    'reduced into a dict': "d = {}\nfunctools.reduce(lambda a, x: a.update({x: 1}) or a, 'ab', d)\nif not d: return",
    'an iterator of a list': 'l = []\nit = iter(l)\nl.append(1)\nif not list(it): return',
}
# Of a whole module: the list of a module, and behaviours beside each other.
MODULES = {
    'filled beside': 'QUEUE = []\ndef other(node, m): vendor.fill(QUEUE)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'heappush beside': 'QUEUE = []\ndef other(node, m): heapq.heappush(QUEUE, m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'an alias beside': 'QUEUE = []\ndef other(node, m):\n    q = QUEUE\n    q.append(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'a bound method beside': 'QUEUE = []\nadd = QUEUE.append\ndef other(node, m): add(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'a function that gives it': 'QUEUE = []\ndef queue(): return QUEUE\ndef other(node, m): queue().append(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'a function that fills its argument': 'QUEUE = []\ndef put(q, x): q.append(x)\ndef other(node, m): put(QUEUE, m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'in a container of the module': "QUEUE = []\nALL = {'a': QUEUE}\ndef other(node, m): ALL['a'].append(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO",
    'an inner list': "ALL = {'a': []}\ndef other(node, m): ALL['a'].append(m)\ndef hear(node, m):\n    if not ALL['a']: return\n    GO",
    'an inner list by get': "ALL = {'a': []}\ndef other(node, m): ALL.get('a').append(m)\ndef hear(node, m):\n    if not ALL['a']: return\n    GO",
    'inner lists in a loop': "ALL = {'a': []}\ndef other(node, m):\n    for each in ALL.values(): each.append(m)\ndef hear(node, m):\n    if not ALL['a']: return\n    GO",
    'a flag in a dict': "STATE = {'ready': False}\ndef other(node, m): vendor.start(STATE)\ndef hear(node, m):\n    if not STATE['ready']: return\n    GO",
    'a flag in a dict by update': "STATE = {'ready': False}\ndef other(node, m): dict.update(STATE, ready=True)\ndef hear(node, m):\n    if not STATE['ready']: return\n    GO",
    'a flag by global': 'READY = False\ndef other(node, m):\n    global READY\n    READY = True\ndef hear(node, m):\n    if not READY: return\n    GO',
    'a flag by globals()': "READY = False\ndef other(node, m): globals()['READY'] = True\ndef hear(node, m):\n    if not READY: return\n    GO",
    'a flag by globals().update': 'READY = False\ndef other(node, m): globals().update(READY=True)\ndef hear(node, m):\n    if not READY: return\n    GO',
    'a flag by the module': 'READY = False\ndef other(node, m): sys.modules[__name__].READY = True\ndef hear(node, m):\n    if not READY: return\n    GO',
    'a flag by setattr': "READY = False\ndef other(node, m): setattr(sys.modules[__name__], 'READY', True)\ndef hear(node, m):\n    if not READY: return\n    GO",
    'a flag by vars': "READY = False\ndef other(node, m): vars(sys.modules[__name__])['READY'] = True\ndef hear(node, m):\n    if not READY: return\n    GO",
    'a flag by exec': "READY = False\ndef other(node, m): exec('READY = True', globals())\ndef hear(node, m):\n    if not READY: return\n    GO",
    'a flag of a class': 'class Box:\n    ready = False\ndef other(node, m): Box.ready = True\ndef hear(node, m):\n    if not Box.ready: return\n    GO',
    'a flag of a class by setattr': "class Box:\n    ready = False\ndef other(node, m): setattr(Box, 'ready', True)\ndef hear(node, m):\n    if not Box.ready: return\n    GO",
    'a flag of a class elsewhere': 'class Box:\n    ready = False\ndef other(node, m): vendor.start(Box)\ndef hear(node, m):\n    if not Box.ready: return\n    GO',
    'a list of a class': 'class Box:\n    items = []\ndef other(node, m): vendor.fill(Box.items)\ndef hear(node, m):\n    if not Box.items: return\n    GO',
    'an object': 'class Box:\n    def __init__(self): self.items = []\nBOX = Box()\ndef other(node, m): vendor.fill(BOX)\ndef hear(node, m):\n    if not BOX.items: return\n    GO',
    'a list of an object': 'class Box:\n    def __init__(self): self.items = []\nBOX = Box()\ndef other(node, m): heapq.heappush(BOX.items, m)\ndef hear(node, m):\n    if not BOX.items: return\n    GO',
    'a namespace': 'BOX = types.SimpleNamespace(items=[], ready=False)\ndef other(node, m): vendor.fill(BOX)\ndef hear(node, m):\n    if not BOX.ready: return\n    GO',
    'a deque with a bound method': 'QUEUE = deque()\ndef other(node, m): threading.Timer(1, QUEUE.append, (m,)).start()\ndef hear(node, m):\n    while QUEUE:\n        QUEUE.popleft()\n        GO',
    'a default of a function': 'def put(x, items=[]):\n    items.append(x)\n    return items\ndef other(node, m): put(m)\ndef hear(node, m):\n    if len(put(m)) == 1: return\n    GO',
    'a default that a behaviour keeps': 'def hear(node, m, seen=[]):\n    if not seen:\n        vendor.fill(seen)\n        return\n    GO\ndef other(node, m): pass',
    'filled and returned': 'QUEUE = []\ndef hear(node, m):\n    if not QUEUE:\n        vendor.fill(QUEUE)\n        return\n    GO\ndef other(node, m): pass',
    'a decorator': 'HANDLERS = []\n@vendor.register(HANDLERS)\ndef handle(): pass\ndef hear(node, m):\n    if not HANDLERS: return\n    GO\ndef other(node, m): pass',
    'at the top': 'QUEUE = []\nvendor.fill(QUEUE)\ndef hear(node, m):\n    if not QUEUE: return\n    GO\ndef other(node, m): pass',
    'in the default of a lambda': 'QUEUE = []\nput = lambda x, q=QUEUE: q.append(x)\ndef other(node, m): put(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'in a partial': 'QUEUE = []\nput = functools.partial(heapq.heappush, QUEUE)\ndef other(node, m): put(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'a tuple of them': 'A, B = [], []\ndef other(node, m):\n    for each in (A, B): each.append(m)\ndef hear(node, m):\n    if not A: return\n    GO',
    'with': 'QUEUE = []\ndef other(node, m):\n    with vendor.filling(QUEUE): pass\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'match': 'QUEUE = []\ndef other(node, m):\n    match QUEUE:\n        case x: x.append(1)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'walrus': 'QUEUE = []\ndef other(node, m): (q := QUEUE).append(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'an or': 'QUEUE = []\ndef other(node, m): (QUEUE or QUEUE).append(m)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'star': 'QUEUE = []\nARGS = (QUEUE, 1)\ndef other(node, m): heapq.heappush(*ARGS)\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'an extended slice': 'QUEUE = []\ndef other(node, m): QUEUE[:] = [m]\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
    'augmented': 'QUEUE = []\ndef other(node, m):\n    q = QUEUE\n    q += [m]\ndef hear(node, m):\n    if not QUEUE: return\n    GO',
}
# Of a class whose methods are the behaviours.
CLASSES = {
    'filled beside': 'self.items = []|vendor.fill(self.items)|if not self.items: return',
    'heappush beside': 'self.items = []|heapq.heappush(self.items, m)|if not self.items: return',
    'a bound method': 'self.items = []\nself.add = self.items.append|self.add(m)|if not self.items: return',
    'an alias': 'self.items = []|q = self.items\nq.append(m)|if not self.items: return',
    'two names': 'self.items = self.queue = []|self.queue.append(m)|if not self.items: return',
    'its own list in a list': 'self.items = []\nself.all = [self.items]|self.all[0].append(m)|if not self.items: return',
    'self is passed on': 'self.ready = False|vendor.start(self)|if not self.ready: return',
    'self is passed on where it is made': 'self.ready = False\nvendor.start(self)|pass|if not self.ready: return',
    'self is passed on to a thread': 'self.ready = False|threading.Thread(target=work, args=(self,)).start()|if not self.ready: return',
    'self is stored': 'self.ready = False|vendor.current = self|if not self.ready: return',
    'setattr': "self.ready = False|setattr(self, 'ready', True)|if not self.ready: return",
    'setattr with a name': 'self.ready = False|setattr(self, m.header.frame_id, True)|if not self.ready: return',
    'vars': "self.ready = False|vars(self)['ready'] = True|if not self.ready: return",
    'vars update': 'self.ready = False|vars(self).update(ready=True)|if not self.ready: return',
    '__dict__': "self.ready = False|self.__dict__['ready'] = True|if not self.ready: return",
    '__dict__ update': 'self.ready = False|self.__dict__.update(ready=True)|if not self.ready: return',
    'object.__setattr__': "self.ready = False|object.__setattr__(self, 'ready', True)|if not self.ready: return",
    'super().__setattr__': "self.ready = False|super().__setattr__('ready', True)|if not self.ready: return",
    'None': 'self.link = None|vendor.connect(self)|if self.link is None: return',
    'a counter': 'self.count = 0|vendor.count(self)|if self.count == 0: return',
    'a flag in a dict': "self.state = {'on': False}|vendor.start(self.state)|if not self.state['on']: return",
    'a flag in a dict by setdefault': "self.state = {}|self.state.setdefault('on', True)|if 'on' not in self.state: return",
    'a list in a dict': "self.state = {'l': []}|self.state['l'].append(m)|if not self.state['l']: return",
    'for target': 'self.last = None|for self.last in vendor.items(): pass|if self.last is None: return',
    'with target': 'self.last = None|with vendor.open() as self.last: pass|if self.last is None: return',
    'tuple target': 'self.last = None|self.last, _ = vendor.pair()|if self.last is None: return',
    'augmented': 'self.items = []|self.items += [m]|if not self.items: return',
    'a callback': 'self.items = []\nvendor.register(self.put)|pass\ndef put(self, x): self.items.append(x)|if not self.items: return',
    'a callback that sets': 'self.ready = False\nvendor.register(self.put)|pass\ndef put(self, x): self.ready = True|if not self.ready: return',
    'a lambda': 'self.items = []|vendor.run(lambda: self.items.append(1))|if not self.items: return',
    'a partial': 'self.items = []|vendor.run(functools.partial(list.append, self.items, 1))|if not self.items: return',
    'a decorated method': 'self.items = []|pass\n@vendor.each\ndef put(self, x): heapq.heappush(self.items, x)|if not self.items: return',
    'a property': 'self._items = []|self.items.append(m)\n@property\ndef items(self): return self._items|if not self._items: return',
    'a method that gives it': 'self._items = []|self.items().append(m)\ndef items(self): return self._items|if not self._items: return',
    'a deque': 'self.items = deque(maxlen=3)|vendor.each(self.items.append)|if not self.items: return',
    'a Counter': 'self.items = Counter()|self.items.update(m.header.frame_id)|if not self.items: return',
    'a set': 'self.items = set()|vendor.fill(self.items)|if not self.items: return',
    'an object': 'self.box = Box()|vendor.fill(self.box)|if not self.box.items: return',
    'of an object': 'self.box = Box()|vendor.fill(self.box.items)|if not self.box.items: return',
    'attrgetter': "self.items = []|operator.attrgetter('items')(self).append(m)|if not self.items: return",
    'getattr': "self.items = []|getattr(self, 'items').append(m)|if not self.items: return",
    'getattr with a name': 'self.items = []|getattr(self, m.header.frame_id).append(m)|if not self.items: return',
    'map': 'self.items = []|list(map(self.items.append, m.header.frame_id))|if not self.items: return',
    'star': 'self.items = []|heapq.heappush(*(self.items, 1))|if not self.items: return',
    'yielded': 'self.items = []|pass\ndef each(self): yield self.items|if not self.items: return',
    'conditional': 'self.items = []|(self.items if m else None).append(m)|if not self.items: return',
    'a class attribute': 'pass|type(self).ready = True\nready = False|if not self.ready: return',
}
GO = "node.publish('level', int(node.parameters.speed))"


def indented(text, depth):
    return text.replace('\n', '\n' + ' ' * depth)


def function_text(row):
    rest = '' if 'GO' in row else '\n    GO'
    return 'def hear(node, m):\n    ' + indented(row, 4) + rest + OTHER


def class_text(row):
    made, changed, guard = row.split('|')
    done, *methods = re.split(r'\n(?=def |@|ready)', changed, maxsplit=1)
    methods = ''.join(methods)
    return f"""
class Box:
    def __init__(self): self.items = []
def work(box): vendor.fill(box)
class Rover:
    {indented(methods, 4)}
    def __init__(self, node):
        {indented(made, 8)}
    def other(self, node, m):
        {indented(done, 8)}
    def hear(self, node, m):
        {guard}
        GO
"""


ROWS = {
    **{f'function: {name}': (SYSTEM, function_text(row)) for name, row in IN_FUNCTION.items()},
    **{f'module: {name}': (SYSTEM, row) for name, row in MODULES.items()},
    **{f'class: {name}': (OBJECT, class_text(row)) for name, row in CLASSES.items()},
}


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize(('system', 'text'), ROWS.values(), ids=ROWS)
def test_what_is_reached_is_used(check, system, text):
    assert check(system, HEAD + text.replace('GO', GO)) == []


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize(('system', 'text'), ROWS.values(), ids=ROWS)
def test_an_error_in_what_is_reached_is_found(check, system, text):
    code = HEAD + text.replace('GO', GO.replace('level', 'levle'))
    line = next(number for number, each in enumerate(code.splitlines(), 1) if 'levle' in each)
    assert (line, 'unknown-publisher') in check(system, code)
