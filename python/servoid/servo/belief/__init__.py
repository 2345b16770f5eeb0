"""The target's estimated state: filters, jumps, unobservable rotations, and monitors."""
