"""Compliant motors: what they do to the targets, and what the play of their gears would."""
