"""Poses and calibrations of cameras, from the messages of a bag."""
