"""Commands that make shots: robots from files and characters, materials."""
