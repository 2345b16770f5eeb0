"""Reproduces the paper's experiments: its fitness map, its two ellipsoids, its servoing."""
