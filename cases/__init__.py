"""gearbench.cases"""
