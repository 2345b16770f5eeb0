"""Throws damaged input at everything that reads; see `fuzz/run.py`."""
