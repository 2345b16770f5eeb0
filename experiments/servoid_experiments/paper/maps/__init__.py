"""The fitness map of Section 5.1, Fig. 8: what poses around the true one are worth."""
