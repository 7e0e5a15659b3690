"""What behaviours do with their node, as their syntax shows: nothing is computed or imported."""
