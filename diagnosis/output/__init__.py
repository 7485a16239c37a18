"""Output error: rigs fitted to records as they are simulated, all unknowns together, and the evidence of effects."""
