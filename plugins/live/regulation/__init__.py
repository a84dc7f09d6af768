"""The regulator: its gains in a pose, limits of the commands, and when deviations are let go of."""
