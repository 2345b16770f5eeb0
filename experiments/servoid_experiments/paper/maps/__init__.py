"""The fitness map of Section 5.1, Fig. 8: the fitness of poses around the true one."""
