"""What was measured on a robot, and what follows from it for the parameters of its model."""
