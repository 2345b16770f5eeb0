"""Arms and their eyes: shipped ones, those of files, how physics drives them."""
