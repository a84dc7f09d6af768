"""The compiled model: topology, joints and bodies as flat arrays."""
