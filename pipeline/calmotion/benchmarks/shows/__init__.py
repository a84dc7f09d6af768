"""The benchmarks of long performances, batches and repertoires."""
