"""How numerical kernels of this room are compiled: once, kept on disk, without the GIL."""

import numba

compiled = numba.njit(cache=True, nogil=True, fastmath=False)
