"""Commands that are played on the simulated robot: what they cost at the targets, and the lowest rate that does."""
