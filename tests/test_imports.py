"""The structure of the package: which room imports which, and what a folder holds."""

import re
from collections import Counter
from functools import cache
from pathlib import Path

import composer

PACKAGE = Path(composer.__file__).parent
# From low to high: a room imports from itself and from rooms above it in this list.
ROOMS = (
    *(
        'errors',
        'signals',
        'version',
        'spelling',
        'terminal',
        'input_limits',
        'records',
        'names',
        'programs',
        'ament',
        'confidential',
        'entity_kinds',
        'rules',
        'diagnostics',
    ),
    *('yaml_text', 'expressions', 'schema', 'ros_parameters', 'language', 'network', 'interfaces'),
    *(
        'python_source',
        'node_uses',
        'checks',
        'planning',
        'drawing',
        'executor',
        'processes',
        'runtime',
        'launch_files',
    ),
    *('virtual_time', 'recordings', 'foxglove', 'simulation', 'scenarios', 'reports'),
    'stubs',
    *('export', 'hosts'),
    'application',
    'page',
    *('cli', 'pytest_plugin', 'api', '__init__', '__main__'),
)
# Of these names there are several, which are the same thing in several rooms.
SHARED_NAMES = {
    '__init__.py',
    'declarations.py',  # of commands
    'check.py',  # what is wrong, and the command that shows it
    'environment.py',  # variables, and their checks
    'differences.py',  # between definitions, and between systems
    'names.py',  # the rules for names, and their checks
    'parameter_files.py',  # as a system names them, and their checks
    'parameters.py',  # their checks, and their life in a node
    'plan.py',  # what an edit does, and the command that shows it
    'qos.py',  # profiles and policies, and their checks
    'evaluation.py',  # of expressions, and of expectations
    'specs.py',  # the records that a file is parsed into
    'project_modules.py',  # as type checkers see them, and as simulations forget them
    'reading.py',  # what was read: of a behaviour, and of a system
    'json_document.py',  # a form of reports, plans and drawings
    'text.py',  # the same form, of reports and plans
}
MOST_FILES = 16


def _is_code(path):
    # Projects to copy, and examples, which may be wrong on purpose.
    inside = path.relative_to(PACKAGE).parts
    return inside[0] != 'templates' and not (inside[0] == 'rules' and len(inside) > 2)


FILES = sorted(path for path in PACKAGE.rglob('*.py') if _is_code(path))


def name_of(path):
    parts = ['composer', *path.relative_to(PACKAGE).with_suffix('').parts]
    return '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)


MODULES = {name_of(path): path for path in FILES}


def room_of(module):
    parts = module.split('.')
    return parts[1] if len(parts) > 1 else '__init__'


IMPORT = re.compile(
    r'^ *(?:from (composer[\w.]*) import (\([^)]*\)|.*)|import (composer[\w.]*))', re.MULTILINE
)


@cache
def imports_of(module):
    """Return the modules that one imports anywhere, those for type checkers included."""
    found = set()
    text = MODULES[module].read_text()
    assert not re.search(r'^ *from \.', text, re.MULTILINE), f'{module} has a relative import'
    for source, names, whole in IMPORT.findall(text):
        words = re.findall(r'(\w+)(?: as \w+)?', names.partition('#')[0])
        inner = {f'{source}.{name}' for name in words}
        found |= inner & MODULES.keys()
        found |= {source} if inner - MODULES.keys() else set()
        found.add(whole)
    return found & MODULES.keys() - {module}


def test_imports_point_down():
    upwards = {
        (module, each)
        for module in MODULES
        for each in imports_of(module)
        if ROOMS.index(room_of(each)) > ROOMS.index(room_of(module))
    }
    assert not upwards


def test_no_modules_import_each_other_in_a_circle():
    pending = {module: set(imports_of(module)) for module in MODULES}
    while free := {module for module, needs in pending.items() if not needs}:
        pending = {module: needs - free for module, needs in pending.items() if module not in free}
    assert not pending


def test_the_executor_knows_nothing_of_composer():
    inside = {module for module in MODULES if room_of(module) == 'executor'}
    outside = {each for module in inside for each in imports_of(module)} - inside
    assert outside == {'composer.errors'}


def test_a_folder_is_read_at_a_glance():
    counts = Counter(path.parent for path in FILES)
    assert {folder: count for folder, count in counts.items() if count > MOST_FILES} == {}


def test_a_file_name_means_one_thing():
    counts = Counter(path.name for path in FILES)
    assert {name for name, count in counts.items() if count > 1} == SHARED_NAMES
