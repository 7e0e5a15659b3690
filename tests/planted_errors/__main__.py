"""python -m tests.planted_errors [--behaviours | --systems 2000 --seed 1]"""

import argparse
import tempfile
from pathlib import Path

from tests.planted_errors.measurement import measure
from tests.planted_errors.planted_robots import ROWS, measure_behaviours


def main():
    """Plant errors in systems and print what share of them is found."""
    parser = argparse.ArgumentParser(prog='python -m tests.planted_errors')
    parser.add_argument('--systems', type=int, default=2000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--errors', type=int, default=4, help='the most errors of one file')
    parser.add_argument('--show', type=int, default=10, help='how many missed ones are shown')
    parser.add_argument('--behaviours', action='store_true', help='those of behaviours instead')
    arguments = parser.parse_args()
    if arguments.behaviours:
        with tempfile.TemporaryDirectory() as folder:
            missed = measure_behaviours(Path(folder))
        for case in missed:
            print(*case[:3], sep=' | ')
        print(f'{len(ROWS) - len(missed)} of {len(ROWS)} found in their lines')
        return
    with tempfile.TemporaryDirectory() as folder:
        score = measure(Path(folder), arguments.seed, arguments.systems, arguments.errors)
    for kind, planted in sorted(score.planted.items()):
        found = f'{score.found[kind]}/{planted} found, {score.in_line[kind]} in line'
        suggested = f'{score.suggested[kind]}/{score.to_suggest[kind]} suggested'
        print(f'{kind:20} {found}, {suggested}')
    for title in ('false_alarms', 'extra', 'missed'):
        cases = getattr(score, title)
        print(f'{title}: {len(cases)}')
        for case in cases[: arguments.show]:
            print('  ', ' | '.join(map(_shown, case)))
    for what, share in score.shares().items():
        print(f'{what}: {share:.2%}')


def _shown(part):
    if hasattr(part, 'rule'):
        return f'{part.span} {part.rule}: {part.message} ({part.help})'
    return str(part)


if __name__ == '__main__':
    main()
