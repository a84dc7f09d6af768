"""BDF2, Newmark, generalised-alpha and RK4 behind one interface, and Newton's method."""
