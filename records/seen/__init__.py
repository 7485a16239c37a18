"""A record as its checks see it: channels, spectra, what the mesh force is by each account, what a check finds."""
