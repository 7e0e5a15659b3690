"""YAML text ⇄ plain data, with positions and comments."""
