"""The paper's experiments again: its fitness map, its model of two ellipsoids, its servoing."""
