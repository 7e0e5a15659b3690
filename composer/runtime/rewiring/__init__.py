"""A running system becomes another one: what an edit changes is changed, all else runs on."""
