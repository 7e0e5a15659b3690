"""Virtual time: one thread at a time, and a clock that moves when all of them wait."""
