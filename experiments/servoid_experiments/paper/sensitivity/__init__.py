"""Which of the constants that the paper leaves out matter."""
