"""Keeps an arm within its limits, and holds it when necessary."""
