"""How runs are repeated and divided: again when a file is saved, and as jobs in other processes."""
