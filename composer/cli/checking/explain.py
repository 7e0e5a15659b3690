"""`composer explain`: what a rule means, why it exists, and how to fix what it finds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application.output import wants_colour
from composer.errors import ExitCode
from composer.rules import load_families, load_rule
from composer.rules.examples import load_example

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.rules import Rule
    from composer.rules.examples import Example

_NEEDS = {
    'interfaces': 'Needs interface packages, which come with ROS 2.',
    'import': '`composer check --import` finds more than the source of the behaviour shows.',
}


def explain(name: str | None) -> int:
    """Explain a rule, or list all by family."""
    lines = _list_all() if name is None else _explain(load_rule(name))
    colour = wants_colour()
    for line in lines:
        click.echo(line, color=colour)
    return ExitCode.DONE


def _list_all() -> Iterator[str]:
    families = load_families()
    widest = max(len(rule.name) for family in families for rule in family.rules)
    for family in families:
        yield click.style(f'{family.name}: {family.title}', bold=True)
        for rule in family.rules:
            yield f'  {rule.name:<{widest}}  {rule.meaning}'
        yield ''
    yield "'composer explain RULE' explains a rule, with an example."


def _explain(rule: Rule) -> Iterator[str]:
    heading = f'{rule.name}: {rule.severity.value}, in the family {rule.family}'
    yield click.style(heading, bold=True)
    yield ''
    yield f'  {rule.meaning}'
    yield f'  {rule.why}'
    if rule.needs:
        yield f'  {_NEEDS[rule.needs]}'
    if rule.ignorable:
        yield f'  To silence it, add a comment to the line: # composer: ignore[{rule.name}]'
    if rule.source:
        yield f'  Source: {rule.source}'
    example = load_example(rule.name)
    if example:
        yield from _show(example)


def _show(example: Example) -> Iterator[str]:
    yield from _block('Bad:', example.bad, 'red')
    for path, text in example.others.items():
        yield from _block(f'With {path}:', text, None)
    yield from _block('What Composer reports:', example.report, None)
    yield from _block('Good:', example.good, 'green')


def _block(title: str, text: str, colour: str | None) -> Iterator[str]:
    yield ''
    yield click.style(title, fg=colour, bold=True)
    for line in text.splitlines():
        yield f'  {line}'.rstrip()
