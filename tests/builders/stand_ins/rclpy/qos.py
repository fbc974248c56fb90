"""Stand-in for rclpy.qos."""

qos_profile_sensor_data = object()
