"""`composer schema`: print the JSON Schema, for editors and other programs."""

from __future__ import annotations

import click

from composer.errors import ExitCode
from composer.schema import schema_path


def print_schema(*, path_only: bool) -> int:
    """Print the schema, or its path."""
    path = schema_path()
    click.echo(path if path_only else path.read_text(encoding='utf-8'), nl=path_only)
    return ExitCode.DONE
