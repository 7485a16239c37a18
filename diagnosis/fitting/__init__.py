"""Rigs fitted to the records as they are simulated, all unknowns together, from where their structure is found."""
