"""What a shot animates by time samples or splines, and what the simulation takes for constant."""
