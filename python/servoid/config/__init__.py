"""Reads files within size limits, and converts them strictly to settings."""
