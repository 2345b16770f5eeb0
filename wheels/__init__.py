"""Builds the wheels that are handed out, checks them, and tries them where nothing else is."""
