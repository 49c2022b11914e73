"""`torquer kernels`: compile now, for machines that shall not compile."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.strict_json import json_text
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions, Json, options
from torquer.cli.output import harmless, make_writable, progress_bar


@options
class KernelOptions:
    """Options of `torquer kernels build`."""

    out: Annotated[Path, Parameter(help="Folder for the kernels; must be new or empty.")]
    json: Json = False


def build(*scenarios: Path, how: KernelOptions) -> int:
    """Compile what the runs of SCENARIOS need, for any processor of this kind.

    Where TORQUER_KERNELS names the folder, `torquer` reads its code instead of compiling.
    """
    from torquer.compile.code_cache import SOURCES
    from torquer.compile.ready import VARIABLE, write_manifest
    from torquer.compile.turns import TURNS

    if not scenarios:
        raise ValueError("SCENARIOS: at least one must be given; received none")
    for path in scenarios:
        load_checked(path, CodeOptions(no_user_code=True))
    make_writable(how.out)
    if any(how.out.iterdir()):
        raise ValueError(f"--out: must be a new or empty folder; received {how.out}")
    with progress_bar() as shown:
        for path in shown.track(scenarios, description="compiling"):
            _compile(path, how.out)
    (how.out / SOURCES / TURNS).unlink(missing_ok=True)
    files = [file for file in (how.out / SOURCES).rglob("*") if file.is_file()]
    write_manifest(how.out, SOURCES)
    for folder in (how.out, how.out / SOURCES):  # private to its user as a cache is
        folder.chmod(0o755)
    size = sum(file.stat().st_size for file in files)
    if how.json:
        print(json_text({"folder": str(how.out), "files": len(files), "bytes": size}))
        return 0
    print(harmless(f"{how.out}: {len(files)} files, {size / 1e6:.1f} MB, sources {SOURCES}"))
    print(harmless(f"to use it: export {VARIABLE}={how.out.absolute()}"))
    return 0


def _compile(scenario: Path, folder: Path) -> None:
    """Run a scenario with its report in a process that keeps its compiled code in the folder."""
    from torquer.compile.ready import GENERIC, VARIABLE

    given = {**os.environ, **GENERIC, VARIABLE: "", "TORQUER_CACHE_DIR": str(folder.absolute())}
    given.pop("NUMBA_DISABLE_JIT", None)
    out = tempfile.mkdtemp(prefix="torquer-kernels-")
    command = [sys.executable, "-m", "torquer", "run", str(scenario), "--out", out]
    try:
        ended = subprocess.run(command, env=given, capture_output=True, text=True)
    finally:
        shutil.rmtree(out, ignore_errors=True)
    if ended.returncode:
        raise ValueError(f"{scenario}: its run failed: {ended.stderr.strip().splitlines()[-1]}")
