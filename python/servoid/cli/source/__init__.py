"""`servoid record` and `servoid sources`, and what all commands that take a SOURCE share."""
