"""The force missing from each equation of motion, and how it depends on the unknowns."""
