"""What keeps an arm within its limits, and what holds it."""
