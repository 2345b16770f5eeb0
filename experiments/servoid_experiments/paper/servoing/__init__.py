"""The servoing of Section 5.3, Figs. 10 and 11, with changes, and the paper's future work."""
