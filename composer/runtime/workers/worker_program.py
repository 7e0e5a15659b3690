"""The program of a worker: it runs the nodes that the process of the system tells it to."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

# Python has put the folder of this file first, whose modules are not to be imported by their
# short names.
sys.path[0] = str(Path(__file__).parents[3])

if __name__ == '__main__':
    # What is imported stays: to look for garbage in it takes a tenth of the time to start.
    gc.disable()
    from composer.runtime.workers.worker_process import main

    main(sys.argv[1])
