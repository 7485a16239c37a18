"""Experiments and statics on the reduced finite-element model."""
