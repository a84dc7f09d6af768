"""Compliant motors: drives, and servos with their rotors."""
