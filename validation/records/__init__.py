"""Stores of runs with observations, recordings and times; merging and pruning of stores."""
