"""The command `servoid scan`, and the scan that `servoid model` runs first."""
