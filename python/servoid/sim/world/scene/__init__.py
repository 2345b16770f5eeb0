"""What stands in the world: objects, room, solids, contacts."""
