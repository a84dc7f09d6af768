"""What recordings tell before a search: their clocks, their noise, and the free decay after a motion."""
