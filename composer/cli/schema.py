"""`composer schema`: print the JSON Schema, for editors and other programs."""

from __future__ import annotations

import json

import click

from composer.errors import ExitCode
from composer.schema import schema_path


def print_schema(*, path_only: bool, matrix: bool) -> int:
    """Print the schema of systems or of matrix files, or the path of the first."""
    path = schema_path()
    if matrix:
        schema = json.loads(path.read_text(encoding='utf-8'))
        definitions = {name: schema['$defs'][name] for name in ('combinations', 'combination')}
        part = {'$schema': schema['$schema'], '$ref': '#/$defs/combinations'}
        click.echo(json.dumps(part | {'$defs': definitions}, indent=2))
        return ExitCode.DONE
    click.echo(path if path_only else path.read_text(encoding='utf-8'), nl=path_only)
    return ExitCode.DONE
