"""The experiments behind servoid, each a batch of seeded trials with its pictures and page."""
