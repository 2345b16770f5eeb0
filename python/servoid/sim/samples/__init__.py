"""Captures that are drawn: objects, scenes and how they move."""
