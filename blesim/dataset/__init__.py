"""Recordings and tracks on disk: HDF5 both ways, its validator, and other formats."""
