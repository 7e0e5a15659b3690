"""python -m tests.fuzz --count 200000 --seed 1"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from tests.fuzz.examination import examine_all, seed_texts
from tests.fuzz.mutations import mutate

_PORTION = 2000


def main():
    """Examine mutated inputs; keep those that fail."""
    parser = argparse.ArgumentParser(prog='python -m tests.fuzz', description=main.__doc__)
    parser.add_argument('--count', type=int, default=200_000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--first', type=int, default=0, help='the number of the first input')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--keep', type=Path, default=Path('build/fuzz'))
    arguments = parser.parse_args()
    begun = time.monotonic()
    texts = seed_texts()
    failures = []
    arguments.keep.mkdir(parents=True, exist_ok=True)
    last = arguments.first + arguments.count
    for first in range(arguments.first, last, _PORTION):
        count = min(_PORTION, last - first)
        found = examine_all(arguments.seed, count, first=first, jobs=arguments.jobs)
        for failure in found:
            kept = arguments.keep / f'{arguments.seed}-{failure.index}'
            kept.with_suffix('.yaml').write_bytes(mutate(texts, arguments.seed, failure.index))
            kept.with_suffix('.txt').write_text(failure.what)
        failures += found
        taken = time.monotonic() - begun
        print(f'{first + count} inputs, {len(failures)} failures, {taken:.0f} s', flush=True)
    kinds = Counter(failure.what.strip().splitlines()[-1][:200] for failure in failures)
    for kind, times in kinds.most_common():
        print(f'{times} x {kind}')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
