"""Which effect that the simulation leaves out causes its gap to the measurement."""
