"""The unreduced finite-element model: all unknowns of both gears in time."""
