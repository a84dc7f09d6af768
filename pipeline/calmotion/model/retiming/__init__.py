"""The tempo of a performance, and an animation at a tempo."""
