"""From the columns of a measured file to a record: channel map, guess, clock, angles, integration."""
