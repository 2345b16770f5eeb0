"""The command `pick`."""
