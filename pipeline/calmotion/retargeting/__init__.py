"""The optimiser: motor offsets that remove the vibration."""
