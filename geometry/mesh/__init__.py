"""Finite-element meshes of tooth sectors and whole gears."""
