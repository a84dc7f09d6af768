"""What the scripts that build the samples share: closed shapes, keyed curves, and the authoring of a robot."""
