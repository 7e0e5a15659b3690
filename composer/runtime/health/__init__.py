"""The health of a running system: diagnostics, hanging behaviours, unmatched endpoints."""
