"""Closed solids from surfaces with gaps, junctions and several parts."""
