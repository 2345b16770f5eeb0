"""How many metres the unit of a scan is: by a length, a board, or a second eye."""
