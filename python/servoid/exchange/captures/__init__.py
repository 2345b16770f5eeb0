"""Captures in other people's formats."""
