"""Public names of `calmotion.linear_algebra`: each is imported when it is first used."""

from calmotion.linear_algebra.blas_threads import one_blas_thread as one_blas_thread
