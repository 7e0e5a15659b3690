"""How the processes of a system find each other across hosts."""
