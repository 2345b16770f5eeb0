"""From the error of a pose to a hand's twist and to speeds of joints; the gaze."""
