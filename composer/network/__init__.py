"""How the processes of a system find each other, and what their messages go through."""
