"""Process start-up of a command, before imports that take a second: thread counts of BLAS, no OpenGL, and signals. Import it first."""

import os
import signal

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")  # before numpy: the matrices are small, and a fixed order of sums keeps runs equal to the bit


def handle_signals(name: str) -> None:
    """If the module of that `__name__` is the command: end it with one line on Ctrl-C and SIGTERM, until it installs its own handlers."""
    if name == "__main__":
        os.environ.setdefault("MUJOCO_GL", "off")  # MuJoCo would look for a window library, in a process of its own; physics needs none
        os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")  # or an escape sequence ends the output, NO_COLOR or not
        signal.signal(signal.SIGINT, _end)
        signal.signal(signal.SIGTERM, _end)


def _end(number: int, frame: object) -> None:
    os.write(2, b"oio: stopped.\n")
    os._exit(130)  # an exception would be caught, or shown with its trace, by whatever is being imported
