"""gearbench.bench"""
