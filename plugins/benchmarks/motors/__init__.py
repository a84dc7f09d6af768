"""Motors that give, and what commands for them bring."""
