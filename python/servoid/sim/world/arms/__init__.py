"""Arms with cameras: shipped ones, those of files, and their simulated drives."""
