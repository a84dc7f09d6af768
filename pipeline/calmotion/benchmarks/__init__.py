"""The benchmarks of `calmotion bench`; only this command imports them."""
