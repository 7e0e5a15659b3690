import textwrap

import pytest

from composer.checks import check_system, create_context
from composer.drawing.picture import build_picture
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language import load_system


@pytest.fixture
def draw(tmp_path, monkeypatch):
    """Return a function that makes a picture of the text of a file."""
    monkeypatch.chdir(tmp_path)

    def draw(text, *settings):
        (tmp_path / 'robot.yaml').write_text(textwrap.dedent(text).lstrip())
        system = load_system(tmp_path / 'robot.yaml', settings=settings)
        catalogue = InterfaceCatalogue()
        findings = check_system(system, catalogue)
        return build_picture(create_context(system, catalogue)[0], findings)

    return draw


@pytest.fixture
def needs_graphviz():
    pytest.importorskip('pygraphviz', reason='the extra graph is not installed')
