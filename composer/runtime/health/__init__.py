"""How the system is doing: diagnostics, hangs, unmatched ends."""
