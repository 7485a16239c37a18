"""Two gears: kinematics, interference, data sheet, zones of contact."""
