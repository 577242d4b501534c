"""The frozen sum of all parameters of a simulation, read from YAML."""
