"""Plain data ⇄ what rclpy takes: messages, arrays in them, QoS profiles."""
