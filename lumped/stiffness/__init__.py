"""Mesh stiffness by analytic methods and standards."""
