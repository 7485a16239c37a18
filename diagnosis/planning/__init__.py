"""Before measuring: what the records of a planned experiment would tell about the rig that they are taken from."""
