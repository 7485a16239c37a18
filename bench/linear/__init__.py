"""Experiments and statics on the linear lumped model."""
