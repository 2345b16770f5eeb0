"""The command `servo`."""
