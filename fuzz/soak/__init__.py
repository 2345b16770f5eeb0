"""Tracks and servoes for hours while cameras fail at random, and says what was not as promised."""
