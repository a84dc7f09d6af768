"""What becomes of the links of robots that others made."""
