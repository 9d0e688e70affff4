"""From a request to observations: choice of cells, compilation, runs and certificates."""
