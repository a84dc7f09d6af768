"""Parts of the report of a run, as text."""
