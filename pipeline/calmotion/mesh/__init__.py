"""From what a link is made of to tetrahedra with interface patches."""
