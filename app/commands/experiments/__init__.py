"""Commands that run a rig, once or many times."""
