"""What a search makes small, and what it keeps within limits: one module for each kind."""
