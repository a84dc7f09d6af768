"""Robots of URDF and MJCF files: checked, converted in an environment of its own, and made a shot."""
