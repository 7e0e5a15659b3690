"""`composer` and `python -m composer`."""

from composer import signals


def main() -> None:
    """Run the command line of this process, and exit with its code."""
    # Before the imports, which take longer than all before them.
    signals.end_at_signals()
    from composer.cli.main import main as run_command_line

    run_command_line()


if __name__ == '__main__':
    main()
