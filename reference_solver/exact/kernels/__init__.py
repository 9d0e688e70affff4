"""Flat kernels: arrays in, arrays out, and at most three levels of calls."""
