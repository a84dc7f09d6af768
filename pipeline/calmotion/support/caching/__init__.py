"""Caches on disk: their folder, their limits, and files that are verified before they are used."""
