"""The local polynomial method for periodically time-varying systems."""
