"""Who walks: itineraries and gait as SimPy processes, and the exact trajectories they leave."""
