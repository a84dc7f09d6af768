"""A robot in URDF or MJCF before it is converted: what it says, and what of it is repaired or refused."""
