"""What a running system does beside its external processes: actions when they end."""
