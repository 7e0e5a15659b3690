import itertools as it
from typing import Iterator, Optional

NOTES = dict(c=262, d=294, e=330, g=392)


def _phrase(notes: str, *, repeat: int = 1) -> Iterator[int]:
    for note in notes * repeat:
        yield NOTES[note]


def play(node):
    try:
        yield from _phrase('cde', repeat=2)
        yield from _phrase('ggedc')
        yield from (NOTES[n] // 2 for n in 'ceg')
    finally:
        node.state.__dict__.pop('heard', None)


def blink(node) -> Iterator[Optional[bool]]:
    yield from it.islice(it.cycle([True, None, False, None]), 30)


def countdown(node, start):
    n = start
    while n:
        n -= 1
        yield f'{n}' if n else 'lift-off'


def _chapters():
    received = yield 'once upon a time'
    while received is None:
        received = yield '...'
        break
    return 'the end'


def story(node):
    ending = yield from _chapters()
    yield ending


def hear(node, message):
    heard = getattr(node.state, 'heard', ())
    node.state.heard = (*heard, message.data)[-3:]
