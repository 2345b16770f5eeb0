"""What one device sends: JPEG images without an end, and images that hold those of two eyes."""
