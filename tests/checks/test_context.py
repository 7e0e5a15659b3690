"""What checks are given."""

import gc
import weakref

from composer.checks.checker import check_in_context, create_context
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from tests.running import ROOT


def test_what_was_checked_is_gone_at_once_when_nobody_needs_it():
    """A system that runs is checked after each edit: garbage would stop its callbacks for long."""
    system = load_system(ROOT / 'configs' / 'greeter.yaml')
    context = create_context(system, InterfaceCatalogue())
    assert context is not None
    assert not check_in_context(system, context)
    kept = weakref.ref(context)
    gc.collect()
    gc.disable()
    try:
        del context
        assert kept() is None
    finally:
        gc.enable()
