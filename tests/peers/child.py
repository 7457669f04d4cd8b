"""Programs that end with the test that began them, however that ends: one that is killed tells nobody."""

import ctypes
import signal

# prctl(2).
_PR_SET_PDEATHSIG = 1
# Loaded here: between fork and exec there is no time for it.
_LIBC = ctypes.CDLL(None)


def dies_with_its_parent():
    """To be called in the new program's process: `Popen(…, preexec_fn=dies_with_its_parent)`."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
