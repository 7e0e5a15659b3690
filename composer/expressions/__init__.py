"""Expressions in YAML: `{{ … }}`, `foreach` and `when`."""
