"""`composer new`: create a project or a ROS package from the files in `composer/templates`.

Each template is itself a project, called `my_system`. A name that starts with `dot_` there starts
with a dot in the new project.
"""

from __future__ import annotations

import keyword
import re
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError, ExitCode, UsageError
from composer.schema import SCENARIO_SCHEMA_NAME, SCHEMA_NAME, schema_path

if TYPE_CHECKING:
    from collections.abc import Iterator

_TEMPLATE_NAME = 'my_system'
_NAME = re.compile('[a-z][a-z0-9_]*')


def create_project(name: str, *, is_package: bool = False) -> int:
    """Create a project, or a ROS package for colcon, in the folder `name`; return the exit code.

    Raises:
        UsageError: The name cannot name a project.
        ComposerError: The folder exists and is not empty, or cannot be written.
    """
    _check_name(name)
    if is_package and (template_folder('ros_package') / name).exists():
        message = f"'{name}' cannot name a ROS package: it is the name of a folder in it"
        raise UsageError(message)
    folder = Path(name)
    files = (
        _template_files(name, template_folder('ros_package'))
        if is_package
        else _project_files(name)
    )
    try:
        _check_free(folder)
        written = [_write(folder / path, text) for path, text in files]
    except OSError as error:
        message = f'cannot write {error.filename or folder}: {error.strerror}'
        raise ComposerError(message) from error
    click.echo(f'created {folder}:')
    for path in sorted(written):
        click.echo(f'  {path.relative_to(folder)}')
    system = f'{name} {name}.yaml' if is_package else f'configs/{name}.yaml'
    build = ['colcon build --symlink-install', '. install/setup.sh']
    before, test = (build, 'colcon test') if is_package else ([f'cd {name}'], 'composer test')
    click.echo('\n  '.join(['run it:', *before, f'composer up {system}', test]))
    return ExitCode.DONE


def template_folder(name: str = 'new') -> Path:
    """Return the folder with the files of a new project."""
    return Path(str(resources.files('composer'))) / 'templates' / name


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        message = (
            f"'{name}' cannot name a project: use lower-case letters, digits and underscores, "
            'starting with a letter'
        )
        near = _NAME.search(re.sub('[^a-z0-9_]+', '_', name.lower()).strip('_'))
        raise UsageError(message, help=f"try '{near[0]}'" if near else None)
    if keyword.iskeyword(name):
        message = f"'{name}' cannot name a project: it is a Python keyword"
        raise UsageError(message)


def _check_free(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        what = 'is not empty' if folder.is_dir() else 'is not a folder'
        message = f'{folder} already exists and {what}'
        raise ComposerError(message, help='use another name, or move it')


def _project_files(name: str) -> Iterator[tuple[Path, str]]:
    """Yield the path in the project and the text of each file."""
    yield from _template_files(name, template_folder())
    for schema in (SCHEMA_NAME, SCENARIO_SCHEMA_NAME):
        yield Path('schemas', schema), schema_path(schema).read_text(encoding='utf-8')


def _template_files(name: str, template: Path) -> Iterator[tuple[Path, str]]:
    """Yield the path in the project and the text of each file of a template."""
    for path in sorted(template.rglob('*')):
        if path.is_dir() or '__pycache__' in path.parts:
            continue
        parts = path.relative_to(template).parts
        named = [re.sub('^dot_', '.', part).replace(_TEMPLATE_NAME, name) for part in parts]
        yield Path(*named), path.read_text(encoding='utf-8').replace(_TEMPLATE_NAME, name)


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding='utf-8')
    return path
