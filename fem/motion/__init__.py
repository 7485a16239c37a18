"""The reduced rig in motion: equations of motion and their time integration."""
