"""The scene of a world: visuals, room, collision shapes, contacts."""
