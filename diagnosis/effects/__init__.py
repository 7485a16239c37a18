"""What may be at work in a measured rig: one file for each effect, the background of all, and free forms."""
