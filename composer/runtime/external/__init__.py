"""External processes of a running system: actions when they end, components in containers."""
