"""Sparse Cholesky factorisation by nested dissection and multifrontal elimination, and block Lanczos."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
