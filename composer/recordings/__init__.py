"""Recordings: MCAP files as rosbag2 writes them, written and read."""
