"""YAML text → `SystemSpec`; `pipeline` has the steps in their order."""
