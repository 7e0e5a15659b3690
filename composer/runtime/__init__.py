"""`SystemSpec` → a living system on rclpy."""
