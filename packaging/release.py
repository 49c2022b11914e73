"""Check that a release may be made: a line for each condition, exit code 1 if one fails.

    python packaging/release.py [--draft]

`--draft` leaves out what only a release must have (addresses, a clean and tagged tree, a dated
changelog). The sdist and the wheel are built into a temporary folder, and the wheel is installed
into a bare environment there; nothing is uploaded.
"""

import argparse
import re
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import venv
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = re.search(r'VERSION = "(.*)"', (ROOT / "torquer/base/version.py").read_text())[1]
#: What a user's type checker must find out about the package.
TYPED = "import torquer\nreveal_type(torquer.bdot_gain)\ntorquer.simulate(1)\n"


def run(*command, cwd: Path = ROOT) -> str:
    """What a command prints; RuntimeError with its last line if it fails."""
    ended = subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True)
    if ended.returncode:
        said = (ended.stderr or ended.stdout).strip().splitlines()
        raise RuntimeError(f"{command[0]}: {said[-1] if said else 'failed'}")
    return ended.stdout


def must(holds: object, said: str) -> None:
    """RuntimeError unless it holds."""
    if not holds:
        raise RuntimeError(said)


def tracked() -> set[str]:
    """Files of the repository; of an unpacked sdist, where there is no git, those in it."""
    if not (ROOT / ".git").exists():
        return {p.relative_to(ROOT).as_posix() for p in ROOT.rglob("*") if p.is_file()}
    return set(run("git", "ls-files").splitlines())


# --------------------------------------------------------------------------- what a release needs


def addresses(_: Path) -> None:
    """pyproject.toml has the addresses of the project"""
    wrong = [name for name, address in PROJECT["urls"].items() if ".invalid" in address]
    must(not wrong, f"project.urls: must be real addresses; placeholders: {', '.join(wrong)}")


def tree(_: Path) -> None:
    """the tree is clean and has the tag of the version"""
    must(not run("git", "status", "--porcelain").strip(), "uncommitted changes")
    must(f"v{VERSION}" in run("git", "tag", "--points-at", "HEAD").split(), f"no tag v{VERSION}")


def changelog(_: Path) -> None:
    """the changelog has a date for the version"""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    must(
        re.search(rf"^## {re.escape(VERSION)} - \d{{4}}-\d\d-\d\d$", text, re.M), "no such heading"
    )


# --------------------------------------------------------------------------- what always holds


def citation(_: Path) -> None:
    """CITATION.cff is of this version"""
    must(f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text(), f"must be {VERSION}")


def kernels(_: Path) -> None:
    """the extra `kernels` asks for the kernels of this version"""
    asked = PROJECT["optional-dependencies"]["kernels"]
    must(asked == [f"torquer-kernels=={VERSION}"], f"must be of {VERSION}; received {asked[0]}")


def recipe(_: Path) -> None:
    """the conda recipe has the dependencies of pyproject.toml"""
    text = (ROOT / "packaging/conda/meta.yaml").read_text().replace("matplotlib-base", "matplotlib")
    there = {line.strip(" -").replace(" ", "") for line in text.splitlines()}
    missing = [each for each in PROJECT["dependencies"] if each not in there]
    must(not missing, f"missing: {', '.join(missing)}")


def sdist(folder: Path) -> None:
    """the sdist has every file of the repository"""
    build("sdist", folder, ROOT)
    with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
        there = {name.partition("/")[2] for name in archive.getnames()}
        archive.extractall(folder / "source", filter="data")
    missing = {name for name in tracked() if not name.startswith((".", "runs/"))} - there
    must(not missing, f"missing: {', '.join(sorted(missing)[:5])}")


def wheel(folder: Path) -> None:
    """the wheel made from the sdist has py.typed, the examples and all modules, and no tests"""
    build("wheel", folder, next((folder / "source").iterdir()))
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as archive:
        there = set(archive.namelist())
    missing = {name for name in tracked() if name.startswith("torquer/")} - there
    must(not missing, f"missing: {', '.join(sorted(missing)[:5])}")
    must(not any(name.startswith("tests/") for name in there), "tests in the wheel")
    must(any(name.endswith("examples/chibis_m_detumble.toml") for name in there), "no examples")


def build(kind: str, folder: Path, source: Path) -> None:
    """Build a distribution of a source; the build backend must be installed here."""
    call = f"from setuptools import build_meta as b; b.build_{kind}({str(folder)!r})"
    run(sys.executable, "-c", call, cwd=source)


def bare(folder: Path) -> None:
    """installed from the wheel into a bare environment, the command line works"""
    venv.create(folder / "bare", with_pip=True)
    run(python(folder), "-m", "pip", "install", "-q", next(folder.glob("*.whl")))
    call = (python(folder), "-m", "torquer")
    must(VERSION in run(*call, "version", cwd=folder), "another version")
    run(*call, "init", "satellite", "--example", "chibis_m_detumble", cwd=folder)
    run(*call, "validate", "satellite.toml", cwd=folder)


def typed(folder: Path) -> None:
    """a type checker there knows the types of the package"""
    run(python(folder), "-m", "pip", "install", "-q", "mypy")
    (folder / "user.py").write_text(TYPED)
    check = [str(python(folder)), "-m", "mypy", "user.py"]
    said = subprocess.run(check, cwd=folder, capture_output=True, text=True).stdout
    must("damping_time_s: float" in said, said.strip())
    must('has incompatible type "int"; expected "Scenario' in said, said.strip())


def newcomer(folder: Path) -> None:
    """from the wheel to the gains of an own satellite in ten minutes"""
    run(sys.executable, ROOT / "packaging/newcomer.py", next(folder.glob("*.whl")))


def python(folder: Path) -> Path:
    """The bare environment's interpreter."""
    places = (folder / "bare/bin/python", folder / "bare/Scripts/python.exe")
    return next(place for place in places if place.exists())


Check = Callable[[Path], None]
ALWAYS: tuple[Check, ...] = (citation, kernels, recipe, sdist, wheel, bare, typed, newcomer)
FOR_RELEASE: tuple[Check, ...] = (addresses, tree, changelog)


def results(checks: tuple[Check, ...], folder: Path) -> Iterator[tuple[str, str]]:
    """What each check is about, and why it fails ("" if it does not)."""
    for check in checks:
        try:
            check(folder)
        except (RuntimeError, StopIteration, OSError) as error:
            yield check.__doc__ or "", str(error) or "not there"
        else:
            yield check.__doc__ or "", ""


def main() -> int:
    """Print a line for each check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--draft", action="store_true")
    given = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory(prefix="torquer-release-") as folder:
        for about, why in results((() if given.draft else FOR_RELEASE) + ALWAYS, Path(folder)):
            print(f"{'FAILS' if why else 'ok   '} {about}{': ' if why else ''}{why}", flush=True)
            failed += bool(why)
    print(f"version {VERSION}: {failed} of the conditions fail" if failed else f"version {VERSION}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
