"""Captures in other programs' formats."""
