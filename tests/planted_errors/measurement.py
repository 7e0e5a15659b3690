"""How many planted errors are found, on the right line, with the right suggestion."""

import copy
import random
from collections import Counter
from dataclasses import dataclass, field

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from tests.planted_errors.plants import plant
from tests.planted_errors.systems import Function, Generator
from tests.planted_errors.writing import write_yaml

# What is rightly said of one end when the other has another name.
CONSEQUENCES = (
    'no-publisher',
    'no-subscription',
    'no-server',
    'unused-parameter',
    'unknown-parameter',
)


@dataclass
class Score:
    """Counts by kind of error, and the cases that were missed."""

    planted: Counter = field(default_factory=Counter)
    found: Counter = field(default_factory=Counter)
    in_line: Counter = field(default_factory=Counter)
    to_suggest: Counter = field(default_factory=Counter)
    suggested: Counter = field(default_factory=Counter)
    false_alarms: list = field(default_factory=list)
    extra: list = field(default_factory=list)
    missed: list = field(default_factory=list)

    def shares(self):
        """Return the shares found, in the right line, and with the right suggestion."""
        return {
            'found': self.found.total() / max(1, self.planted.total()),
            'in the right line': self.in_line.total() / max(1, self.planted.total()),
            'with the right suggestion': self.suggested.total() / max(1, self.to_suggest.total()),
        }


def measure(folder, seed, systems, errors=4):
    """Return the score over systems that are made, checked, spoilt and checked again."""
    score, catalogue = Score(), InterfaceCatalogue()
    for number in range(systems):
        chance = random.Random(f'{seed}:{number}')
        home = folder / str(number)
        home.mkdir()
        system = Generator(chance).system()
        system.twice, system.catalogue = set(), catalogue
        _, findings = _check(home, system, random.Random(number), catalogue)
        score.false_alarms += [(number, each) for each in findings]
        spoilt = copy.deepcopy(system)
        spoilt.catalogue = catalogue
        planted = plant(chance, spoilt, chance.randint(1, errors))
        lines, findings = _check(home, spoilt, random.Random(number), catalogue)
        _count(score, number, planted, lines, findings)
    return score


def _check(home, system, chance, catalogue):
    text, lines = write_yaml(system.data, chance, system.twice)
    path = home / 'system.yaml'
    path.write_text(text)
    for module, functions in system.modules.items():
        sources = [
            each.source(name) if isinstance(each, Function) else f'{name} = {each}\n'
            for name, each in functions.items()
        ]
        (home / f'{module}.py').write_text(''.join(sources))
    return lines, check_system(load_system(path), catalogue)


def _count(score, number, planted, lines, findings):
    open_findings = list(findings)
    for error in planted:
        score.planted[error.kind] += 1
        score.to_suggest[error.kind] += error.meant is not None
        line = lines[error.path]
        right = [each for each in open_findings if each.rule in error.rules]
        right.sort(
            key=lambda each: (each.span.line != line, f"'{error.meant}'" not in (each.help or ''))
        )
        if not right:
            score.missed.append((number, error, line, 'not found'))
            continue
        best = right[0]
        open_findings.remove(best)
        score.found[error.kind] += 1
        if best.span.line != line:
            score.missed.append((number, error, line, best))
            continue
        score.in_line[error.kind] += 1
        if error.meant is None:
            continue
        if f"'{error.meant}'" in (best.help or ''):
            score.suggested[error.kind] += 1
        else:
            score.missed.append((number, error, line, best))
    score.extra += [(number, each) for each in open_findings if each.rule not in CONSEQUENCES]
