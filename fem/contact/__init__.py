"""Where teeth touch: kinematics, kernels, contact lines, the contact law of a pair, statics with it."""
