"""From a request to observations: which cells, compiled ahead, run and certified in a process of its own if need be."""
