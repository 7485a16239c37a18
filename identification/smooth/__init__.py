"""The local method with a prior: branches as smooth random functions of frequency, for records that are short."""
