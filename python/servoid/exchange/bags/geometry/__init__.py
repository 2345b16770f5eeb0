"""Where cameras were and how they see, by what a bag says of it."""
