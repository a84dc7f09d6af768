"""What benchmarks share: shots, arguments, tables, timing."""
