"""What a link is made of: parts, printed cores, masses."""
