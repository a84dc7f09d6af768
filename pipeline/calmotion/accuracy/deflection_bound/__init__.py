"""An upper bound of the deflection of a flexible body, before it is meshed."""
