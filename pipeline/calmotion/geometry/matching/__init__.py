"""Surfaces that are alike."""
