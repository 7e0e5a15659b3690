"""Which system a command asks: one on this ROS graph by its name, or the hosts of files."""

from __future__ import annotations

import click

from composer.errors import UsageError
from composer.records import record


@record
class AskedSystem:
    """What the command line says of a system.

    Attributes:
        words: Its name; or its file, layers and arguments.
        set_values: Values to change in the files.
        hosts: The names of those to ask; empty for all.
    """

    words: tuple[str, ...]
    set_values: tuple[str, ...]
    hosts: tuple[str, ...]

    @property
    def are_files(self) -> bool:
        """Whether the words are files: then the hosts of these are asked."""
        return bool(self.words) and self.words[0].endswith(('.yaml', '.yml'))

    @property
    def name(self) -> str | None:
        """The name of the system; `None` if none was given.

        Raises:
            click.UsageError: There is more than a name.
            UsageError: There are options that are about files.
        """
        if len(self.words) > 1:
            message = f'Got unexpected extra argument ({self.words[1]})'
            raise click.UsageError(message, click.get_current_context())
        for option, values in (('--set', self.set_values), ('--host', self.hosts)):
            if values:
                message = f'{option} is about the hosts of a file, and none was given'
                raise UsageError(message, help='name the FILE and its layers')
        return self.words[0] if self.words else None
