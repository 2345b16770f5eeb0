"""Streams of one device: endless JPEG images, and images that contain those of two eyes."""
