"""What benchmarks share: shots, tables, timing, figures."""
