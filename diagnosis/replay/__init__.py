"""Rigs simulated under the records' own torque: gap, gap budget."""
