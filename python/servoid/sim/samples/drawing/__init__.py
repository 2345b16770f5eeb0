"""What the samples are drawn by, in NumPy: solids, how rays meet them, and what paints them."""
