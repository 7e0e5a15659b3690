"""What tests of the rules share: a system and its behaviours, from texts."""

from textwrap import dedent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system


@pytest.fixture
def check(tmp_path, monkeypatch):
    """Return a function that checks a system whose behaviours are in the module `parts`.

    It returns each finding's line and rule, or of one rule the messages, or the helps.
    """
    monkeypatch.chdir(tmp_path)

    def run(nodes, code='', *, before='', rule=None, installed=True, tells='message'):
        (tmp_path / 'parts.py').write_text(dedent(code))
        path = tmp_path / 'system.yaml'
        listed = nodes.lstrip('\n')
        path.write_text(f'version: 1\n{before}nodes:\n{listed}')
        catalogue = InterfaceCatalogue() if installed else InterfaceCatalogue(prefixes=[])
        findings = check_system(load_system(path), catalogue)
        if rule is None:
            # Systems of a table have state for all its rows.
            kept = [finding for finding in findings if finding.rule != 'unused-state']
            return [(finding.span.line, finding.rule) for finding in kept]
        return [getattr(finding, tells) for finding in findings if finding.rule == rule]

    return run
