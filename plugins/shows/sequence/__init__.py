"""Repertoires: clips that may follow one another in any order, and the transitions between them."""
