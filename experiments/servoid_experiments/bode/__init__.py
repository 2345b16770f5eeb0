"""Frequency responses of recognition, gaze and hand, and the stability margins of the loop."""
