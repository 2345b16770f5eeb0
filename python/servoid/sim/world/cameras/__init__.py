"""What cameras make of a scene: exposure, rows, light, the two renderers."""
