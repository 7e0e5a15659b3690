"""Stands in for a program: writes down what it was given, and waits for its end.

A script of its own: nothing of Composer is imported. Its arguments are the folder that it writes
to, whether it ends at once (`1`), and the command line of the program.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from itertools import pairwise
from pathlib import Path

_FILE_OPTION = '--params-file'


def main() -> None:
    """Write down what the program was given, and wait."""
    folder, ends, *command = sys.argv[1:]
    files = {}
    for option, path in pairwise(command):
        if option == _FILE_OPTION:
            try:
                files[path] = Path(path).read_text(encoding='utf-8')
            except OSError as error:
                files[path] = f'# {error.strerror}'
    given = {'argv': command, 'env': dict(os.environ), 'cwd': str(Path.cwd()), 'files': files}
    # Written as a whole: whoever looks meanwhile finds nothing.
    hidden = Path(folder) / f'.{os.getpid()}'
    hidden.write_text(json.dumps(given), encoding='utf-8')
    hidden.rename(Path(folder) / f'{os.getpid()}.json')
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(0))
    while ends != '1':
        signal.pause()


if __name__ == '__main__':
    main()
