"""The unreduced rig: every finite-element unknown of both gears integrated in time."""
