"""Replays of records on the reduced finite-element model."""
