"""Meshes and point clouds from files."""

from servoid.exchange.shapes.cloud_file import is_cloud, read_cloud
from servoid.exchange.shapes.mesh_file import SUFFIXES, read_mesh

__all__ = ["SUFFIXES", "is_cloud", "read_cloud", "read_mesh"]
