"""Modules are imported anew from the source that was checked, and put back if that fails."""

import importlib
import sys
from contextlib import contextmanager

import pytest

from composer.runtime.rewiring.fresh_modules import fresh_modules

TEXTS = {
    'fresh_parts': 'from fresh_pack import inner\n',
    'fresh_pack': '',
    'fresh_pack.inner': 'from .low import LOW\n',
    'fresh_pack.low': 'LOW = 1\n',
}


@pytest.fixture
def loaded(tmp_path, monkeypatch):
    """Write and import the modules; return those that are loaded, by their names."""
    for name, text in TEXTS.items():
        path = tmp_path / name.replace('.', '/')
        path = path / '__init__.py' if name == 'fresh_pack' else path.with_suffix('.py')
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, 'dont_write_bytecode', True)
    importlib.import_module('fresh_parts')
    yield {name: sys.modules[name] for name in TEXTS}
    for name in TEXTS:
        sys.modules.pop(name, None)


@contextmanager
def stale(*names, **sources):
    texts = {**TEXTS, **{name.replace('__', '.'): text for name, text in sources.items()}}
    found = {name: text for name, text in texts.items() if text is not None}
    with fresh_modules(names, found) as import_rest:
        yield importlib.import_module('fresh_parts')
        import_rest()


def test_a_module_that_is_imported_from_its_package_is_a_new_one(loaded):
    names = ('fresh_parts', 'fresh_pack.inner', 'fresh_pack.low')
    with stale(*names, fresh_pack__low='LOW = 2\n') as parts:
        assert parts.inner.LOW == 2
        assert parts.inner is not loaded['fresh_pack.inner']
        assert sys.modules['fresh_pack'] is loaded['fresh_pack']


def test_a_module_that_is_gone_cannot_be_imported_and_comes_back_after_that(loaded, tmp_path):
    (tmp_path / 'fresh_pack/low.py').unlink()
    names = ('fresh_parts', 'fresh_pack.inner', 'fresh_pack.low')
    with (
        pytest.raises(ModuleNotFoundError, match=r'fresh_pack\.low'),
        stale(*names, fresh_pack__low=None),
    ):
        pass
    assert {name: sys.modules.get(name) for name in TEXTS} == loaded
    assert loaded['fresh_pack'].inner is loaded['fresh_pack.inner']
    assert loaded['fresh_pack'].low is loaded['fresh_pack.low']


def test_a_module_that_nothing_imports_any_more_is_forgotten(loaded):
    with stale('fresh_parts', 'fresh_pack.low', fresh_parts='', fresh_pack__low=None):
        pass
    assert 'fresh_pack.low' not in sys.modules
    assert not hasattr(loaded['fresh_pack'], 'low')
