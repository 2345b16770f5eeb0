"""Recordings as MCAP: standard messages of ROS 2, and the file that they go into."""
