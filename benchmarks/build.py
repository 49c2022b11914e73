"""Builds the C++ rival: `python build.py`, or `build_cpp()` from the benchmark."""

import shutil
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
SOURCES = (HERE / "detumble.cpp", HERE / "field_wide.h", Path(__file__))
FLAGS = ("-std=c++17", "-O3", "-march=native")


def compiler_version(compiler: str = "g++") -> str:
    """First line of the compiler's own description."""
    done = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[0]


def _compiled(name: str, compiler: str, *flags: str) -> Path:
    target = HERE / "build" / name
    newest = max(source.stat().st_mtime for source in SOURCES)
    if target.exists() and target.stat().st_mtime > newest:
        return target
    if shutil.which(compiler) is None:
        raise RuntimeError(f"compiler: {compiler} must be on the path; received none")
    target.parent.mkdir(exist_ok=True)
    command = [compiler, *FLAGS, *flags, str(SOURCES[0]), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stderr}")
    return target


def build_cpp(wide: bool = False, compiler: str = "g++") -> Path:
    """The shared library; `wide`: with the field in hand-vectorised form (four orders at once)."""
    name, flags = ("wide", ("-DWIDE_FIELD",)) if wide else ("plain", ())
    return _compiled(f"libdetumble_{name}.so", compiler, "-shared", "-fPIC", *flags)


def build_program(compiler: str = "g++") -> Path:
    """The same source as a program: `detumble coefficients.txt [key=value ...]`."""
    return _compiled("detumble", compiler)


if __name__ == "__main__":
    print(compiler_version(), *FLAGS)
    for built in (build_cpp(), build_cpp(wide=True), build_program()):
        print(built)
