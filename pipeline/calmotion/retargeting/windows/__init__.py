"""Long performances: searches in windows in time, each of which goes on from the state in which the last one ends."""
