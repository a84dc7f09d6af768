"""Parameters of a robot from recordings of its performance."""
