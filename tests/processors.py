"""The suite under other numeric kernels: `make test-processors`; arguments go to pytest.

OpenBLAS, NumPy and Numba each choose code for the processor that they find, and round
differently on each. Here they take that of other processors. A number that only
agrees on one of them is a bug of the code or of the test: find the cause, leave the tolerance.
"""

import os
import subprocess
import sys

from numpy._core import _multiarray_umath as numpy_kernels

#: What NumPy has special code for on this processor, so that it can be kept from using it.
DISPATCHED = [
    name for name in numpy_kernels.__cpu_dispatch__ if numpy_kernels.__cpu_features__[name]
]
#: What a processor must have for a setting, its names in OpenBLAS and Numba, and the parts of
#: NumPy that it does not have.
SETTINGS = {
    "SSE": ("SSE42", "Nehalem", "x86-64", DISPATCHED),
    "AVX": ("AVX", "Sandybridge", "sandybridge", DISPATCHED),
    "AVX2": ("AVX2", "Haswell", "haswell", [name for name in DISPATCHED if name != "X86_V3"]),
    "AVX-512": ("AVX512_SKX", "SkylakeX", "skylake-avx512", []),
}


def available() -> dict[str, dict[str, str]]:
    """Environment variables of the settings that this processor can run."""
    return {
        name: {
            "OPENBLAS_CORETYPE": blas,
            "NUMBA_CPU_NAME": numba,
            "NUMBA_CPU_FEATURES": "",  # those of the name, not those found
            "NPY_DISABLE_CPU_FEATURES": " ".join(without),
        }
        for name, (needed, blas, numba, without) in SETTINGS.items()
        if numpy_kernels.__cpu_features__.get(needed)
    }


def main(arguments: list[str]) -> int:
    """Run the suite under each setting; 1 if one of them fails."""
    failed = []
    for name, settings in available().items():
        print(f"== {name}: {' '.join(f'{k}={v!r}' for k, v in settings.items())}", flush=True)
        command = [sys.executable, "-m", "pytest", "-n", "auto", "--dist", "loadfile", *arguments]
        if subprocess.run(command, env={**os.environ, **settings}).returncode:
            failed.append(name)
    print(f"== failed: {', '.join(failed) or 'none'} of {', '.join(available())}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
