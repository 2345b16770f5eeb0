"""The study of tracking: its limits and its precision."""
