"""A command of torquer in a process that looks like Windows or macOS to Python code.

    python other_system.py win32 run scenario.toml --out out

What the system lacks is missing, and its rules for files hold: on Windows a file that is open is
neither replaced nor removed, a folder is not opened, a lock is `msvcrt`'s. Paths, processes and
terminals remain those of this system; packages of others are imported before.
"""

import asyncio  # noqa: F401
import concurrent.futures.process  # noqa: F401
import contextlib
import fcntl
import importlib
import multiprocessing.popen_spawn_posix  # noqa: F401
import os
import shutil
import signal
import stat
import sys
import tempfile  # noqa: F401
import types

OTHERS = (
    *("numpy", "scipy.linalg", "scipy.optimize", "numba", "llvmlite.binding", "pandas", "xarray"),
    *("h5py", "h5netcdf", "erfa", "pydantic", "cyclopts", "rich.console", "jinja2", "sgp4.api"),
    *("matplotlib.pyplot", "plotly.graph_objects", "uvicorn", "starlette.applications"),
    *("urllib.request", "http.client", "sqlite3", "webbrowser"),
)
#: Names of modules that a system lacks, and whole modules.
NAMES = {
    "darwin": {os: ("posix_fallocate", "sched_getaffinity", "sched_setaffinity")},
    "win32": {
        os: (
            *("fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "getpgid", "setsid"),
            *("killpg", "nice", "sysconf", "posix_fallocate", "sched_getaffinity", "fchmod"),
            *("sched_setaffinity", "chown", "mkfifo", "uname", "wait", "getloadavg"),
            *("O_NONBLOCK", "O_NOFOLLOW", "O_DIRECTORY", "O_CLOEXEC", "WNOHANG"),
        ),
        signal: ("SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGALRM", "pthread_sigmask"),
    },
}
MODULES = {"darwin": (), "win32": ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty")}


def become(system: str) -> None:
    """Look like a system from now on: `win32` or `darwin`."""
    for name in OTHERS:
        importlib.import_module(name)
    with contextlib.suppress(ImportError):  # xarray imports it, which asks the real system
        importlib.import_module("dask.base")
    for module, names in NAMES[system].items():
        for name in names:
            if hasattr(module, name):
                delattr(module, name)
    sys.modules.update(dict.fromkeys(MODULES[system]))
    sys.platform = system
    if system == "win32":
        shutil._use_fd_functions = False
        sys.modules["msvcrt"] = _msvcrt()
        _hold_open_files()


def _msvcrt() -> types.ModuleType:
    """Locks of Windows: of a part of a file, refused at once."""
    module = types.ModuleType("msvcrt")
    module.LK_NBLCK = 2

    def locking(descriptor: int, mode: int, count: int) -> None:
        assert mode == module.LK_NBLCK
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)

    module.locking = locking
    return module


def _hold_open_files() -> None:
    """Refuse to replace or remove what this process has open, and to open folders."""
    opened = os.open

    def open_no_folder(path, flags, *given, **named):
        descriptor = opened(path, flags, *given, **named)
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            os.close(descriptor)
            raise PermissionError(13, "Permission denied", str(path))
        return descriptor

    def guarded(change):
        def changed(*paths, **named):
            for path in paths:
                if _is_open(path):
                    raise PermissionError(32, "the file is used by another process", str(path))
            return change(*paths, **named)

        return changed

    os.open = open_no_folder
    for name in ("unlink", "remove", "replace", "rename"):
        setattr(os, name, guarded(getattr(os, name)))


def _is_open(path) -> bool:
    wanted = os.path.abspath(path)
    with os.scandir("/proc/self/fd") as descriptors:
        for each in descriptors:
            try:
                if os.readlink(each.path) == wanted:
                    return True
            except OSError:
                continue
    return False


if __name__ == "__main__":
    become(sys.argv[1])
    from torquer.cli import main

    sys.argv = ["torquer", *sys.argv[2:]]
    sys.exit(main())
