"""What users do with systems: check, plan, start, reload and ask them.

The command line, `composer.api` and the pytest plugin share this room. Options, words of help and
exit codes are of the command line alone.
"""
