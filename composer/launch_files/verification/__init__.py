"""Whether an imported system gives each process what its launch file gives it."""
