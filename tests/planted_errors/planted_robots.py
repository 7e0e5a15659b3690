"""How many errors that are planted in behaviours, one at a time, are found in their lines."""

import contextlib
import shutil
from pathlib import Path

from composer.checks.checker import check_in_context, create_context
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.stubs.checking.kept_types import TypesCheck
from composer.stubs.checking.type_checker import find_program

ROBOTS = Path(__file__).parents[1] / 'data' / 'valid' / 'robots'
ROWS = [
    tuple(line.split(' | ', 1)[:1] + line.split(' | ', 1)[1].rsplit(' | ', 1))
    for line in Path(__file__).with_suffix('.txt').read_text().splitlines()
    if not line.startswith('#')
]

MISSED = 'missed: '


def find_planted(folder, file, edit):
    """Return the line of a planted error, and the rules of what is found in it and elsewhere."""
    shutil.copytree(ROBOTS, folder, dirs_exist_ok=True)
    path = folder / file
    old, new = edit.replace('\\n', '\n').split(' >>> ')
    before, found, after = path.read_text().partition(old)
    assert found, edit
    line = (before + new.partition('§')[0]).count('\n') + 1
    path.write_text(before + new.replace('§', '') + after)
    system = load_system(path.with_suffix('.yaml').relative_to(Path.cwd()))
    context = create_context(system, InterfaceCatalogue())
    findings = check_in_context(system, context, {'types': TypesCheck(find_program())})
    here = [each.rule for each in findings if each.file == file and each.span.line == line]
    return here, [each.rule for each in findings if each.rule not in here]


def measure_behaviours(folder, rows=ROWS):
    """Return what of the rows is not found in its line: file, edit, rule, and what is found."""
    missed = []
    with contextlib.chdir(folder):
        for file, edit, told in rows:
            here, elsewhere = find_planted(folder, file, edit)
            rule = told.removeprefix(MISSED)
            if rule not in here:
                missed.append((file, edit, rule, here, elsewhere))
    return missed
