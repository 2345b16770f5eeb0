"""Reads meshes and point clouds."""
