"""The commands that show what files say: `show`, `graph`, and `schema` and `stubs` for editors."""
