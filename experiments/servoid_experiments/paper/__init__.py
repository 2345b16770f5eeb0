"""Reproduces the paper's experiments: its fitness map, its two ellipsoids, its servoing."""

AS_ASSUMED = "as assumed"
"""The name of trials in which no number is changed that the paper does not state."""
