"""The events of a world: the object's path, faults, and their times."""
