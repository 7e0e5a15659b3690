"""What tests of simulated systems share, as a fixture."""

from contextlib import ExitStack
from textwrap import dedent

import pytest


@pytest.fixture
def simulate(tmp_path):
    """Return a function that starts a system of YAML and the behaviours of its module `parts`."""
    pytest.importorskip('rclpy')
    from composer.diagnostics import has_errors
    from composer.language.pipeline import load_system
    from composer.simulation.simulated_system import SimulatedSystem

    with ExitStack() as stack:

        def create(text, code='', **options):
            (tmp_path / 'system.yaml').write_text(f'version: 1\n{dedent(text)}')
            (tmp_path / 'parts.py').write_text(dedent(code))
            loaded = load_system(tmp_path / 'system.yaml', [])
            assert not has_errors(loaded.diagnostics), loaded.diagnostics
            system = SimulatedSystem(loaded, **options)
            stack.callback(system.stop)
            return system

        yield create
