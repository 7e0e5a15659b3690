"""Interface definitions: `.msg`, `.srv` and `.action` files, read and checked."""
