"""Recordings: ROS 1 and ROS 2 bags and those of RealSense's SDK, without ROS."""
