"""The content of a bag: its files, topics, timestamps and images."""
