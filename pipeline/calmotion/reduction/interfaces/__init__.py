"""Interface patches: the parts of a surface that joints hold, and how they move."""
