"""Where nodes and processes run: hosts, workers, and what crosses between them."""
