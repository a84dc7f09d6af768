"""Sparse Cholesky factorisation by nested dissection and multifrontal elimination, and block Lanczos."""
