"""Cases as models for other programs."""
