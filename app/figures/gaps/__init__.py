"""Pictures of a diagnosis: where the gap is, what closes it."""
