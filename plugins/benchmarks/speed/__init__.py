"""Where the time of a run goes, and how it grows."""
