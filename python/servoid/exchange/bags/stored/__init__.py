"""What lies in a bag: its files, topics, stamps and images."""
