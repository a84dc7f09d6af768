"""Measurements behind `calmotion bench`; nothing imports this room but the command itself."""
