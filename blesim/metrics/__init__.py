"""How far off a track is: the only place where truth is opened."""
