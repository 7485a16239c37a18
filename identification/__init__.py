"""gearbench.identification"""
