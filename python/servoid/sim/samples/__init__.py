"""Rendered captures: objects, scenes and motions."""
