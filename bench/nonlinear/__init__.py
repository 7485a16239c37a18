"""Experiments, statics and replays on the non-linear lumped model."""
