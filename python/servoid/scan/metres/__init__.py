"""Determines a scan's unit in metres: from a length, a board, or a second camera."""
