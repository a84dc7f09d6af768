"""Compliant motors, and what commands for them bring."""
