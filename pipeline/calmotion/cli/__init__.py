"""The command line: one file a command. Importing the package alone loads nothing."""
