"""A scenario file as the server of cases has read it, before it forks."""

from __future__ import annotations

import importlib
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import load_declared, provide_declared
from composer.language.pipeline import load_system
from composer.language.values.start_reader import StartValueReader
from composer.records import record
from composer.scenarios.running.case_run import run_case
from composer.scenarios.running.warm_up import load_type_supports
from composer.scenarios.scenario_files import load_scenarios

if TYPE_CHECKING:
    from composer.scenarios.running.case_results import CaseRequest, CaseResult
    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.scenarios.specs import CaseSpec


@record
class PreparedFile:
    """A scenario file whose system has been read."""

    loaded: LoadedScenarios

    def limit_of(self, name: str) -> float:
        """Return how long a case may take, in real time."""
        return self.case(name).real_time_limit_sec

    def case(self, name: str) -> CaseSpec:
        """Return a case.

        Raises:
            ComposerError: There is none of this name.
        """
        spec = self.loaded.spec
        if spec is None or name not in spec.cases:
            message = f"{self.loaded.path} has no case '{name}'"
            raise ComposerError(message)
        return spec.cases[name]

    def run(self, request: CaseRequest) -> CaseResult:
        """Run a case in this process."""
        return run_case(self.loaded, self.case(request.case), request)


def prepare_file(name: str) -> PreparedFile:
    """Read a scenario file and its system, and load or build the interfaces that it uses.

    To build them may take longer than a case may.

    Raises:
        ComposerError: The file cannot be read.
    """
    loaded = load_scenarios(Path(name))
    _read_start_values(loaded)
    system = loaded.system
    if system is not None and system.spec is not None:
        types = (end.type for node in system.spec.end_owners() for _, end in node.ends())
        for module in {'.'.join(each.split('/')[:2]) for each in types}:
            # Packages that the file declares are imported by the case.
            with suppress(ImportError):
                importlib.import_module(module)
        load_type_supports()
        # What cannot be built, the case tells.
        with suppress(ComposerError):
            provide_declared(load_declared(system, InterfaceCatalogue()), lambda _line: None)
    return PreparedFile(loaded)


def _read_start_values(loaded: LoadedScenarios) -> None:
    """Read the values that are known when a system starts, once for all cases of a file.

    Raises:
        StartValueError: One cannot be read.
    """
    if loaded.system is None or loaded.spec is None or not loaded.system.start.found:
        return
    reference = loaded.spec.system
    loaded.system = load_system(
        reference.file,
        reference.words,
        layers=reference.layers,
        set_values=reference.set_values,
        read_value=StartValueReader().read,
    )
