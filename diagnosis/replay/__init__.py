"""Rigs simulated under the records' own torque: recalibration, gap, gap budget."""
