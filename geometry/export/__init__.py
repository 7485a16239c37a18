"""Gears and meshes as files for other programs."""
