"""Simulated cameras: exposure, rolling shutter, light, and two renderers."""
