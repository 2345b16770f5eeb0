"""The sensitivity to the constants that the paper does not state."""
