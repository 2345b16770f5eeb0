"""The servoing of Section 5.3, Figs. 10 and 11, what changes it, and the future work it names."""
