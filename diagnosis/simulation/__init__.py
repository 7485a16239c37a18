"""Rigs simulated under the records: which lines count, how close they come, and their derivatives by all unknowns."""
