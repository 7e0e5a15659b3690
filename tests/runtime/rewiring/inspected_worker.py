"""The program of a worker that the game can look into."""

import gc
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).parents[3])

if __name__ == '__main__':
    gc.disable()
    from composer.runtime.workers import worker_process

    class InspectedWorker(worker_process.WorkerProcess):
        """A worker that also does what an `Inspection` does."""

        def __init__(self, name):
            super().__init__(name)
            self._inspection = None
            self._channel._functions['inspect'] = self.inspect

        def inspect(self, name, *arguments):
            """Do something with the nodes."""
            from tests.runtime.rewiring.inspections import Inspection

            self._inspection = self._inspection or Inspection(self._running)
            return getattr(self._inspection, name)(*arguments)

    worker_process.WorkerProcess = InspectedWorker
    worker_process.main(sys.argv[1])
