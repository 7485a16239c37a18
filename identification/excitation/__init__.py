"""What a rig is excited with: multisines and residue combs."""
