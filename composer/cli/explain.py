"""`composer explain`: what a rule means, why it exists, and how to fix what it finds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.cli.output import wants_colour
from composer.errors import ExitCode
from composer.rules import FAMILIES, FAMILY_OF, RULES
from composer.rules.examples import read_example

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.rules.examples import Example
    from composer.rules.record import Rule

_NEEDS = {
    'interfaces': 'Needs interface packages, which come with ROS 2.',
    'import': '`composer check --import` finds more than the source of the behaviour shows.',
}


def explain(name: str | None) -> int:
    """Explain a rule, or list all by family."""
    lines = _list_all() if name is None else _explain(RULES[name])
    colour = wants_colour()
    for line in lines:
        click.echo(line, color=colour)
    return ExitCode.DONE


def _list_all() -> Iterator[str]:
    widest = max(map(len, RULES))
    for family in FAMILIES:
        yield click.style(f'{family.name}: {family.title}', bold=True)
        for rule in family.rules:
            yield f'  {rule.name:<{widest}}  {rule.meaning}'
        yield ''
    yield "'composer explain RULE' explains a rule, with an example."


def _explain(rule: Rule) -> Iterator[str]:
    family = FAMILY_OF[rule.name]
    heading = f'{rule.name}: {rule.severity.value}, in the family {family.name}'
    yield click.style(heading, bold=True)
    yield ''
    yield f'  {rule.meaning}'
    yield f'  {rule.why}'
    if rule.needs:
        yield f'  {_NEEDS[rule.needs]}'
    if rule.is_ignorable:
        yield f'  To silence it, add a comment to the line: # composer: ignore[{rule.name}]'
    if rule.source:
        yield f'  Source: {rule.source}'
    example = read_example(rule.name)
    if example:
        yield from _show(example)


def _show(example: Example) -> Iterator[str]:
    yield from _block('Bad:', example.bad, 'red')
    for path, text in example.others.items():
        yield from _block(f'With {path}:', text, None)
    yield from _block('Output:', example.said, None)
    yield from _block('Good:', example.good, 'green')


def _block(title: str, text: str, colour: str | None) -> Iterator[str]:
    yield ''
    yield click.style(title, fg=colour, bold=True)
    for line in text.splitlines():
        yield f'  {line}'.rstrip()
