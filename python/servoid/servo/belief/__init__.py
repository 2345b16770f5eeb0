"""Where the target is believed to be: filters, jumps, open turns, and the watchdog over them."""
