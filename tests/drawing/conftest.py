import importlib.util
import shutil
import textwrap

import pytest

from composer.checks.checker import check_in_context, create_context
from composer.drawing.picture import build_picture
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Return a function that checks the text of a file."""
    monkeypatch.chdir(tmp_path)

    def read(text, *set_values, name='robot', layer=None):
        path = tmp_path / f'{name}.yaml'
        path.write_text(textwrap.dedent(text).lstrip())
        layers = [tmp_path / 'site.yaml'] if layer else []
        for each in layers:
            each.write_text(layer)
        system = load_system(path, layers=layers, set_values=set_values)
        context = create_context(system, InterfaceCatalogue())
        return context, check_in_context(system, context)

    return read


@pytest.fixture
def draw(read):
    """Return a function that makes a picture of the text of a file."""
    return lambda *given, **options: build_picture(*read(*given, **options))


@pytest.fixture
def external_ends(draw):
    """Return the picture of a node whose other ends are all outside the system."""
    text = """
        version: 1
        nodes:
          a:
            publishers: {x: {type: std_msgs/msg/String, external: true}}
            subscriptions: {y: {type: std_msgs/msg/String, external: true, publish: x}}
            service_clients: {add: {type: std_srvs/srv/Trigger, external: true}}
    """
    return draw(text)


@pytest.fixture
def needs_graphviz():
    if not (shutil.which('dot') or importlib.util.find_spec('pygraphviz')):
        pytest.skip('neither Graphviz nor the extra graph is installed')
