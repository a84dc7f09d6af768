"""The error of a result, measured against a finer run; of a long shot in parts in time."""
