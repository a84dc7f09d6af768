"""What motors may not exceed: one module for each kind of limit."""
