"""Whether the tests notice a wrong kernel: `make mutants`, or `tests/mutants.py --count 20`.

A mutant is the package with one small mistake: a plus for a minus, a bound no longer met, a
constant that is off. The tests must fail on it. One that they let pass shows what they do not
check; one that changes nothing that anyone could observe stands in
`tests/data/equivalent_mutants.json`, with the reason. Mutants are tried in a copy of the tree;
`results.jsonl` beside it holds what has been tried, which is not tried again unless asked for.
"""

import argparse
import ast
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from itertools import chain
from pathlib import Path

from mistakes import KERNEL, ROOMS, ROOT, Mutant, drawn, drawn_of, spoiled

#: Rooms of tests that may notice a mistake. (Those of text notice every edit.)
TESTED = [*ROOMS, "theory", "analysis", "naive", "scenario"]
OF_TEXT = (
    "test_docs.py",
    "test_tutorials.py",
    "test_equations.py",
    "test_layers.py",
    "test_cuda.py",
)
FOLDER = Path(tempfile.gettempdir()) / "torquer-mutants"
CAUGHT, CAUGHT_AT_LEAST = ("caught", "hung"), 0.95
#: No test is silent for so long, not even one that compiles.
HUNG_S = 120.0


def tests_for(file: str, function: str = "") -> list[list[str]]:
    """Files of tests: of the room, those that name what is changed first; then of all others.

    Of these, first the rooms that import the file: the uppermost of them sees most of it.
    """
    room, stem, module = file.split("/")[1], Path(file).stem, file[:-3].replace("/", ".")
    names = re.compile(rf"\b({module}|{function or 'no function'})\b")
    users = {
        path.relative_to(ROOT / "torquer").parts[0]
        for path in (ROOT / "torquer").rglob("*.py")
        if f"from {module} import" in path.read_text()
    }
    order = [*(r for r in reversed(ROOMS) if r in users), *TESTED[TESTED.index(room) :], ""]

    def home(path: Path):
        return "" if path.parent.name == "tests" else path.relative_to(ROOT / "tests").parts[0]

    def rank(path: Path):
        named, at = bool(names.search(path.read_text())), [*order, home(path)].index(home(path))
        return stem not in path.stem, not named, at, str(path)

    files = [path for room in TESTED for path in (ROOT / "tests" / room).rglob("test_*.py")]
    files += [path for path in (ROOT / "tests").glob("test_*.py") if path.name not in OF_TEXT]
    files.sort(key=rank)
    parts = [p for p in files if home(p) == room], [p for p in files if home(p) != room]
    return [[str(path.relative_to(ROOT)) for path in part] for part in parts]


def tests_of(folder: str, file: str = "") -> list[list[str]]:
    """Files of tests: of a folder of the package, those that name a file of it first; then others.

    The others are those elsewhere that name the file's module.
    """
    whole, module = folder.replace("/", "."), file[:-3].replace("/", ".") or "no file"
    mirror = ROOT / "tests" / Path(folder).relative_to("torquer")
    paths = [path for path in (ROOT / "tests").rglob("test_*.py") if path.name not in OF_TEXT]
    named = {path: re.findall(r"\btorquer[.\w]+", path.read_text()) for path in paths}

    def is_of_folder(path: Path) -> bool:
        if mirror.is_dir():
            return path.is_relative_to(mirror)
        return any(f"{name}.".startswith(f"{whole}.") for name in named[path])

    def rank(path: Path):
        return Path(file).stem not in path.stem, module not in named[path], str(path)

    of_folder = sorted(filter(is_of_folder, paths), key=rank)
    others = sorted(path for path in paths if module in named[path] and path not in of_folder)
    return [[str(path.relative_to(ROOT)) for path in part] for part in (of_folder, others)]


def reached_from(tree: Path, file: str) -> set[Path]:
    """A file of the package; if it has kernels, also those that import it, directly or not."""
    if not KERNEL.search((ROOT / file).read_text()):
        return {tree / file}
    imported = {}
    for path in (tree / "torquer").rglob("*.py"):
        nodes = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom)]
        imported[path] = {f"{n.module}.{alias.name}" for n in nodes for alias in n.names}
        imported[path] |= {n.module for n in nodes}
    reached, waiting = set(), [tree / file]
    while waiting:
        reached.add(path := waiting.pop())
        module = ".".join(path.relative_to(tree).with_suffix("").parts)
        waiting += [p for p, names in imported.items() if module in names and p not in reached]
    return reached


class Workshop:
    """The copy of the tree, with compiled code of the unchanged package (`warm`) and a mutant's."""

    def __init__(self, folder: Path, of: str = ""):
        self.of, self.tree, self.warm = of, folder / "tree", folder / "warm"
        self.cache, self.log = folder / "cache", folder / "log"
        listed = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True)
        for name in filter(None, listed.split("\0")):
            to = self.tree / name
            if not to.exists() or to.read_bytes() != (ROOT / name).read_bytes():
                to.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, to)
        self.warm /= self.source_key()
        if not (passed := self.warm / f"passed {of.replace('/', ' ')}".strip()).exists():
            print("the tests of the unchanged package first", flush=True)
            if self.test([*chain(*self.tests())], self.warm.parent):
                sys.exit(f"they do not pass: see {self.log}")
            passed.touch()

    def source_key(self) -> str:
        """The name of the folder of compiled code for the tree as it is."""
        command = [
            sys.executable,
            "-c",
            "import torquer.compile.sources as c; print(c.source_key())",
        ]
        environment = os.environ | {"PYTHONPATH": str(self.tree)}
        return subprocess.check_output(command, env=environment, text=True).strip()

    def tests(
        self, file: str = "torquer/maths/geometry/vec3.py", function: str = ""
    ) -> list[list[str]]:
        """Files of tests that may notice a mistake: those near to it, then the others."""
        return tests_of(self.of, file) if self.of else tests_for(file, function)

    def test(self, files: list[str], cache: Path, budget_s: float | None = None) -> int:
        """The exit status of the tests; TimeoutExpired, with all of them ended, after the time."""
        command = [sys.executable, "-m", "pytest", "-xv", "--tb=no", "-p", "no:cacheprovider"]
        command += ["--hypothesis-seed=0", *files]
        environment = os.environ | {"PYTHONPATH": str(self.tree), "TORQUER_CACHE_DIR": str(cache)}
        with self.log.open("w") as log:
            options = {"stdout": log, "stderr": log, "start_new_session": True}
            process = subprocess.Popen(command, cwd=self.tree, env=environment, **options)
            try:
                return process.wait(budget_s)
            except BaseException:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                raise

    def reuse_code(self, file: str) -> None:
        """Put the compiled code of all that a mutant does not reach where it is looked for."""
        shutil.rmtree(self.cache, ignore_errors=True)
        here = self.cache / self.source_key()
        for path in {*(self.tree / "torquer").rglob("*.py")} - reached_from(self.tree, file):
            home = f"{path.parent.name}_{hashlib.sha1(str(path.parent).encode()).hexdigest()}"
            (here / home).mkdir(mode=0o700, parents=True, exist_ok=True)
            for each in (self.warm / home).glob(f"{path.stem}.*"):
                # its digest is also of its place in the cache
                code, place = each.read_bytes()[:-32], f"{here.name}/{home}/{each.name}\n"
                digest = hashlib.sha256(place.encode() + code).digest()
                (here / home / each.name).write_bytes(code + digest)

    def try_out(self, mutant: Mutant, budget_s: float) -> dict:
        """What the tests say to a mutant: `caught` and by which, `hung` or `survived`."""
        path, began = self.tree / mutant.file, time.time()
        path.write_text(spoiled(path.read_text(), mutant.node))
        try:
            self.reuse_code(mutant.file)
            status = 0
            for files in filter(None, self.tests(mutant.file, mutant.function)):
                status = status or self.test(files, self.cache, began + budget_s - time.time())
            answer = "caught" if status else "survived"
        except subprocess.TimeoutExpired:
            silent_s = time.time() - self.log.stat().st_mtime
            answer = "hung" if silent_s > HUNG_S else "survived in the time"
        finally:
            shutil.copy2(ROOT / mutant.file, path)
        by = re.findall(r"^(?:FAILED|ERROR) (\S+)", self.log.read_text(), re.MULTILINE)
        return {"answer": answer, "by": "".join(by[:1]), "seconds": round(time.time() - began)}


def main() -> int:
    """Try mutants, print what became of each; 1 if too few are caught."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--of", default="", help="a folder such as torquer/campaign: of it alone")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="how many of them to pass over")
    parser.add_argument("--budget-s", type=float, default=240.0, help="time for one mutant")
    parser.add_argument("--again", action="store_true", help="try those that survived once more")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the copy and the results")
    given = parser.parse_args()
    known = json.loads((ROOT / "tests/data/equivalent_mutants.json").read_text())
    equivalent = {(m["file"], m["text"], m["change"]): m["reason"] for m in known}
    given.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    results, answers = given.folder / "results.jsonl", []
    reported = [json.loads(line) for line in results.open()] if results.exists() else []
    tried = {Mutant(*(each[key] for key in Mutant._fields)): each for each in reported}
    workshop, count = Workshop(given.folder.resolve(), given.of), given.first + given.count
    chosen = drawn_of(given.of, given.seed, count) if given.of else drawn(given.seed, count)
    for mutant in chosen[given.first :]:
        if reason := equivalent.get((mutant.file, mutant.text, mutant.change)):
            found = {"answer": "equivalent", "by": reason, "seconds": 0}
        elif not (found := tried.get(mutant)) or (given.again and found["answer"] not in CAUGHT):
            found = mutant._asdict() | workshop.try_out(mutant, given.budget_s)
            with results.open("a") as file:
                file.write(json.dumps(found) + "\n")
        answers.append(found["answer"])
        outcome = f"{found['answer']} {found['by']}".strip()
        place = f"{mutant.file}:{mutant.line}"
        print(f"{place} | {mutant.change} | {outcome} | {found['seconds']} s", flush=True)
    caught = sum(answer in CAUGHT for answer in answers)
    counted = len(answers) - answers.count("equivalent")
    print(f"caught: {caught} of {counted}; equivalent: {len(answers) - counted}")
    return int(caught < CAUGHT_AT_LEAST * counted)


if __name__ == "__main__":
    sys.exit(main())
