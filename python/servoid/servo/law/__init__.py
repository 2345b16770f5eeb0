"""Control laws: from the pose error to the hand's twist and joint speeds, and the gaze."""
