"""gearbench.geometry"""
