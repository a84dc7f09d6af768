"""What every room uses: cache folders, safe writing of files, compilation of kernels, memory, short names."""
