"""From observations to rows: truth and bound, verdict and standing, listed failures, changes between two runs."""
