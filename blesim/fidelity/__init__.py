"""Does the simulated radio look like the recorded one: statistics beside those of a twin."""
