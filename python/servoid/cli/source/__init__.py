"""`servoid record`, `servoid sources`, and the code shared by all commands with a SOURCE."""
