"""The command line: `main` runs it, `commands` declares it, and each command has its own file."""
