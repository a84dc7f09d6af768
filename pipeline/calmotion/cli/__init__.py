"""The command line: one file for each command. Importing the package loads no other module."""
