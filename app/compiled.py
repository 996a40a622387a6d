"""How numerical kernels are compiled: on first use, kept on disk, without the GIL."""

import numba

compiled = numba.njit(cache=True, nogil=True, fastmath=False)
