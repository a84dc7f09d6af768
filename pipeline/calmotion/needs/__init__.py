"""Which parts of all that a shot might have this one needs; importing the package alone loads nothing."""
