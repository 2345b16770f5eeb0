"""Calibrations of cameras by other programs."""
