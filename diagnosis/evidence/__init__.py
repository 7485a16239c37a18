"""Hypotheses, their evidence, and the decision between them."""
