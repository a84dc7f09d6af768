"""What holds a robot on the ground."""
