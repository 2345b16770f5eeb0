"""The report of a servo run."""
