"""Joints: their frames and free directions, what holds a robot in the world, and how bodies hang together."""
