"""`ros2 composer`: the command line of Composer, word for word, as a command of ros2cli.

Source: `CommandExtension` in https://github.com/ros2/ros2cli (`ros2cli/command/__init__.py`).
It is no base class here: ros2cli calls these methods, and Composer may be installed without it.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any


class ComposerCommand:
    """Check and run ROS 2 systems declared in YAML."""

    def add_arguments(self, parser: argparse.ArgumentParser, _cli_name: str) -> None:
        """Take all words, `--help` among them, as they are."""
        parser.prefix_chars = '\0'
        words: Any = parser.add_argument('words', nargs=argparse.REMAINDER)
        words.completer = complete_words

    def main(self, *, parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
        """Become the process of `composer`."""
        del parser
        # ros2cli has imported rclpy, which a system does only after it has set its variables.
        os.execv(sys.executable, [sys.executable, '-P', '-m', 'composer', *args.words])  # noqa: S606 - ourselves


def complete_words(prefix: str, parsed_args: argparse.Namespace, **_options: object) -> list[str]:
    """Return what the shell offers for the last word, as argcomplete asks for it."""
    from click.shell_completion import ShellComplete

    from composer.cli.commands import cli

    shell = ShellComplete(cli, {}, 'composer', '')
    items = shell.get_completions(list(parsed_args.words or ()), prefix)
    names = [item.value for item in items if item.type == 'plain']
    if len(names) < len(items):
        from argcomplete.completers import FilesCompleter

        names += FilesCompleter()(prefix)
    return names
