"""Reads and writes other people's formats."""
