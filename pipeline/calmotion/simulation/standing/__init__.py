"""What robots stand on: soles, centres of pressure, contacts."""
