"""What an installation needs before its first shot."""
