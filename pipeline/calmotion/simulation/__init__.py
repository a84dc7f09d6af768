"""A shot simulated: inputs over a time grid, the forward run, cyclic shots, the report."""
