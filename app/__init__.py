"""gearbench: a virtual gear test rig."""

__version__ = "0.1.0"
