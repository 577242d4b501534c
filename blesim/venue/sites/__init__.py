"""Parametric sites of the published experiments, each from the measures that its paper gives."""
