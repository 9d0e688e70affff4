"""What is kept: stores of runs with observations, recordings and times, which merge and age."""
