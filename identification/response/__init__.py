"""Time-varying frequency responses: the dataset, and modes against mesh phase."""
