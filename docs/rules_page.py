"""Generate the page of the rules: what each means and why, with examples."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.rules import Severity, load_families
from composer.rules.examples import load_example

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.rules import Family, Rule


def rules_page() -> Iterator[str]:
    """Yield the lines of a page with every rule, what it means and why, and an example."""
    yield '# The rules'
    yield ''
    yield 'Generated from `composer/rules/` by `make docs`. `composer explain RULE` prints a rule.'
    yield ''
    families = load_families()
    for family in families:
        links = ', '.join(f'[{rule.name}](#{rule.name})' for rule in family.rules)
        yield f'- **{family.name}** ({family.title}): {links}'
    for family in families:
        yield from _family(family)


def _family(family: Family) -> Iterator[str]:
    yield ''
    yield f'## {family.name.capitalize()}'
    yield ''
    yield f'{family.title[0].upper()}{family.title[1:]}.'
    for rule in family.rules:
        yield ''
        yield f'### {rule.name}'
        yield ''
        weight = '' if rule.severity is Severity.ERROR else 'A warning. '
        yield f'{weight}{rule.meaning} {rule.why}'
        yield from _remarks(rule)
        yield from _rule_example(rule)


def _remarks(rule: Rule) -> Iterator[str]:
    if rule.needs == 'interfaces':
        yield 'Needs interface packages, which come with ROS 2.'
        yield '`# type: ignore` in the line of the module silences it.'
    if rule.ignorable:
        yield f'`# composer: ignore[{rule.name}]` in the line silences it.'
    if rule.source:
        yield ''
        yield f'Source: {rule.source}'


def _rule_example(rule: Rule) -> Iterator[str]:
    example = load_example(rule.name)
    if example is None:
        return
    yield from _block('Bad:', example.bad, 'yaml')
    for path, text in example.others.items():
        yield from _block(f'With `{path}`:', text, 'python' if path.endswith('.py') else '')
    yield from _block('What Composer reports:', example.report, 'text')
    yield from _block('Good:', example.good, 'yaml')


def _block(title: str, text: str, language: str) -> Iterator[str]:
    yield ''
    yield title
    yield ''
    yield f'```{language}'
    yield from text.rstrip('\n').splitlines()
    yield '```'
