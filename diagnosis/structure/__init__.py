"""What a rig has that no nominal case gives, and how all unknowns of a fit make up a case."""
