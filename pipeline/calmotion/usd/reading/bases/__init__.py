"""What holds a robot: its root, and the ground under its feet."""
