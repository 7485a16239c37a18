"""The mesh-feedback estimator: time variation enters through one force, the rest of the machine is time-invariant."""
