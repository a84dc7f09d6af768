"""What is estimated from recordings, and motions that are designed for them, as plain data."""
