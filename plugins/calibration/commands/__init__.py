"""The commands `calibrate`, `excite` and `refine`."""
