"""Files as they come: read within limits, turned strictly into settings."""
