"""Studies beyond single cells: convergence, breaking points, metamorphic tests, trivial answers, sweeps, faults."""
