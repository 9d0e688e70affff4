"""Canonical scenes, truths, metrics, tolerances, verdicts, the cells that run and the store that keeps them."""
