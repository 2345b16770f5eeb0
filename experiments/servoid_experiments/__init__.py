"""The experiments behind servoid, each a batch of seeded trials with figures and a page."""
