"""Results of runs: frequency responses, single numbers, comparisons."""
