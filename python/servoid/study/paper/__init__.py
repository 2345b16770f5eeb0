"""The source paper's experiments, redone."""
