"""Solids, textures and a stage for the scenes of samples."""
