"""Recordings as MCAP: standard ROS 2 messages, and their file."""
