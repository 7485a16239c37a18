"""One elastic gear: plane elasticity of a tooth sector, the ring of sectors, condensation to hub and flanks."""
