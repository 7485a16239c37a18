"""The non-linear model with one mesh spring and the effects of real rigs."""
