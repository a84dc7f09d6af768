"""Joints that follow others: mimic joints, and gears, racks and pinions of PhysX."""
