"""gearbench.lumped"""
