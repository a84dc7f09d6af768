"""What a flexible body is made of: the sources of its solid, and the choice between them."""
