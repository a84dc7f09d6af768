"""BDF2, Newmark, generalised-alpha, RK4 and Radau IIA behind one interface, and Newton's method."""
