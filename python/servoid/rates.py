"""Rates that are assumed where none is given; in a module of its own that help texts can load."""

ASSUMED_HZ = 30.0  # observations per second where the capture has neither times nor a rate
