"""gearbench.records"""
