"""Processes of this program."""
