"""gearbench.fem"""
