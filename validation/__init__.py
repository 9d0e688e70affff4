"""Canonical scenes, truths, metrics, tolerances, verdicts, cells and the store."""
