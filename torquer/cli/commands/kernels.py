"""`torquer kernels`: compile now, for machines that shall not compile."""

import os
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

#: Runs of a campaign that is flown to compile: as many as fly side by side.
_RUNS = 16


@options
class KernelOptions:
    """Options of `torquer kernels build`."""

    out: Annotated[Path, Parameter(help="Folder for the kernels; must be new or empty.")]
    json: Json = False


def build(*scenarios: Path, how: KernelOptions) -> int:
    """Compile what the runs of SCENARIOS need, for any processor of this kind.

    A scenario with a table [campaign] is also flown as a campaign.

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
    """Fly a scenario, with its report, in processes that keep their compiled code in the folder."""
    from torquer.compile.ready import GENERIC, VARIABLE

    given = {**os.environ, **GENERIC, VARIABLE: "", "TORQUER_CACHE_DIR": str(folder.absolute())}
    given.pop("NUMBA_DISABLE_JIT", None)
    with tempfile.TemporaryDirectory(prefix="torquer-kernels-", ignore_cleanup_errors=True) as out:
        for words in _flights(scenario, Path(out)):
            command = [sys.executable, "-m", "torquer", *words]
            ended = subprocess.run(command, env=given, capture_output=True, text=True)
            if ended.returncode:
                last = ended.stderr.strip().splitlines()[-1]
                raise ValueError(f"{scenario}: its {words[0]} failed: {last}")


def _flights(scenario: Path, out: Path) -> list[list[str]]:
    """Commands that fly a scenario: its run, and some runs of its campaign if it has one."""
    from torquer.scenario.load import parse_toml, read_text

    run = ["run", str(scenario), "--out", str(out / "run")]
    if "campaign" not in parse_toml(read_text(scenario, "scenario"), "scenario"):
        return [run]
    fly = ["campaign", str(scenario), "--runs", str(_RUNS), "--out", str(out / "campaign")]
    return [run, fly]
