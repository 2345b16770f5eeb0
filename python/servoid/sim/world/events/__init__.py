"""What happens in the world: paths, faults, and when."""
