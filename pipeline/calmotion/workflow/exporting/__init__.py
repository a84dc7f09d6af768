"""Commands for controllers: written by formats that are plugins, read back and simulated."""
