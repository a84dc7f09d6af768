"""Commands on many shots: batches, render farms, repertoires."""
