"""Commands of motor controllers, as data, and the curves that players make of them."""
