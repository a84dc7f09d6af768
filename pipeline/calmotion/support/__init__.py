"""What every room uses: cache folders, safe writing of files, compilation of kernels, memory, short names."""

import os

from calmotion.public_names import public_names

# numba reads these once, so they are set before any module of this room imports it; a user's own choice stays.
# Compiling is most of a first run. At level 1 it takes two thirds of the time, and the kernels, whose loops are short,
# run no slower.
os.environ.setdefault("NUMBA_OPT", "1")
# numba colours the text of every meaning of an operator that does not fit, which is shown to nobody.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

__getattr__, __dir__ = public_names(__name__)
