"""Read ROS 1 and ROS 2 bags and recordings of RealSense's SDK, without ROS."""
