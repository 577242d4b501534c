"""Does the simulation look like the recording: statistics beside those of a twin."""
