"""From observations to rows: truth and bound, verdict and standing, what is listed, what changed between two runs."""
