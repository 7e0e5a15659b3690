"""What executors cost: `ComposerExecutor` beside those of rclpy."""
