"""The command line: `main` runs it, `commands` lists the commands, and each has its own file."""
