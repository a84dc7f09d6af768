"""Motors that give: drives, and servos with their rotors."""
