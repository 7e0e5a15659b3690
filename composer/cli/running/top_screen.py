"""The screen of `composer top`, in a terminal."""

from __future__ import annotations

import curses
from contextlib import suppress
from dataclasses import replace
from textwrap import wrap
from typing import Any, Protocol

from composer import signals
from composer.application.output import wants_colour
from composer.cli.running.top_table import (
    SORT_NAMES,
    View,
    describe_worst,
    find_worst,
    list_processes,
    render_entities,
    select_entities,
)
from composer.terminal import escape

_REFRESH_MS = 100
_HELP = 'q quit   ←→ sort   r reverse   n nodes   / filter   ↑↓ scroll'
_ENTER = ('\n', '\r')
_ESCAPE = '\x1b'
_BACKSPACES = ('\x7f', '\b', curses.KEY_BACKSPACE)
_COLOURS = {'warn': (1, curses.COLOR_YELLOW), 'error': (2, curses.COLOR_RED)}


class Source(Protocol):
    """Where the figures come from."""

    @property
    def waits_for(self) -> str:
        """Why there is no answer yet."""

    @property
    def document(self) -> dict[str, Any] | None:
        """The last answer of the system."""

    @property
    def error(self) -> Exception | None:
        """Why there are no more answers."""


def can_draw() -> bool:
    """Return whether the terminal can write anywhere: one that is `dumb` or unknown cannot."""
    try:
        curses.setupterm()
    except curses.error:
        return False
    return curses.tigetstr('cup') is not None


def show_screen(source: Source, view: View) -> None:
    """Show the health of a system until the user quits, or there are no more answers."""
    # A lone Escape is not the beginning of a key for long.
    curses.set_escdelay(25)
    with suppress(KeyboardInterrupt), signals.interrupting():
        curses.wrapper(lambda window: _Screen(window, source, view).run())


class _Screen:
    def __init__(self, window: curses.window, source: Source, view: View) -> None:
        self._window = window
        self._source = source
        self._view = view
        self._top = 0
        self._is_typing = False
        self._styles: dict[str, int] = {}

    def run(self) -> None:
        with suppress(curses.error):
            curses.curs_set(0)
        if wants_colour() and curses.has_colors():
            curses.use_default_colors()
            for level, (number, colour) in _COLOURS.items():
                curses.init_pair(number, colour, -1)
                self._styles[level] = curses.color_pair(number)
        self._window.timeout(_REFRESH_MS)
        while self._source.error is None:
            self._draw()
            try:
                key = self._window.get_wch()
            except curses.error:
                continue  # No key came.
            if not self._take(key):
                return

    def _take(self, key: str | int) -> bool:
        """Do what a key says; return whether to go on."""
        if self._is_typing:
            self._type(key)
        elif key == 'q':
            return False
        elif key in (curses.KEY_LEFT, curses.KEY_RIGHT):
            names = list(SORT_NAMES)
            step = 1 if key == curses.KEY_RIGHT else -1
            at = (names.index(self._view.sort) + step) % len(names)
            self._view = replace(self._view, sort=names[at])
        elif key == 'r':
            self._view = replace(self._view, is_reversed=not self._view.is_reversed)
        elif key == 'n':
            by = 'entity' if self._view.by == 'node' else 'node'
            self._view = replace(self._view, by=by)
        elif key == '/':
            self._is_typing = True
        elif key == _ESCAPE:
            self._view = replace(self._view, text='')
        else:
            page = max(1, self._window.getmaxyx()[0] - 4)
            steps: dict[str | int, int] = {
                curses.KEY_UP: -1,
                curses.KEY_DOWN: 1,
                curses.KEY_PPAGE: -page,
                curses.KEY_NPAGE: page,
            }
            self._top += steps.get(key, 0)
        return True

    def _type(self, key: str | int) -> None:
        text = self._view.text
        if key in _ENTER:
            self._is_typing = False
        elif key == _ESCAPE:
            self._is_typing, text = False, ''
        elif key in _BACKSPACES:
            text = text[:-1]
        elif isinstance(key, str) and key.isprintable():
            text += key
        self._top = 0
        self._view = replace(self._view, text=text)

    def _draw(self) -> None:
        height, width = self._window.getmaxyx()
        self._window.erase()
        self._write(height - 1, _HELP, curses.A_DIM)
        document = self._source.document
        if document is None:
            self._write(0, escape(self._source.waits_for))
            self._window.refresh()
            return
        entities = select_entities(document['entities'], self._view)
        worst = [
            line
            for text in (*map(describe_worst, find_worst(document)), *document.get('problems', ()))
            for line in wrap(text, width)
        ]
        processes = list_processes(document)
        room = max(0, height - 3 - len(worst) - len(processes))
        self._top = max(0, min(self._top, len(entities) - room))
        header, *rows = render_entities(entities, self._view.sort, width)
        self._write(0, self._describe(document, len(entities)))
        self._write(1, header, curses.A_REVERSE)
        for line, (row, entity) in enumerate(
            zip(rows[self._top :][:room], entities[self._top :], strict=False), 2
        ):
            self._write(line, row, self._styles.get(entity['level'], 0))
        for line, text in enumerate(worst, height - 1 - len(worst)):
            self._write(line, text, self._styles.get('warn', 0))
        for line, text in enumerate(processes, height - 1 - len(worst) - len(processes)):
            self._write(line, text)
        self._window.refresh()

    def _describe(self, document: dict[str, Any], shown: int) -> str:
        order = ', reversed' if self._view.is_reversed else ''
        whole = select_entities(document['entities'], replace(self._view, text=''))
        noun = 'nodes' if self._view.by == 'node' else 'entities'
        count = f'{shown} of {len(whole)} {noun}'
        text = f'{escape(document["name"])}: {count}, by {self._view.sort}{order}'
        if self._is_typing or self._view.text:
            text += f', filter: {self._view.text}{"_" if self._is_typing else ""}'
        if not document['has_cpu']:
            text += f' (CPU is measured in the next {document["period_sec"]:g} s)'
        return text

    def _write(self, line: int, text: str, style: int = 0) -> None:
        # The last cell of the window cannot be written without an error.
        with suppress(curses.error):
            self._window.addnstr(line, 0, text, self._window.getmaxyx()[1], style)
