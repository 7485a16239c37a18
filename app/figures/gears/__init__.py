"""Pictures of gears at rest: teeth, static transmission error, stiffness, stress."""
