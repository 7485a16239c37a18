"""Stress of a pair: fields at a mesh phase, roots over the mesh cycle."""
