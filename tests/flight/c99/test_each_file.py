"""Each file of an export compiled alone with flags that change bits: somebody notices."""

import subprocess
from pathlib import Path

import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import EXAMPLES
from flight.c99.test_library import OTHERWISE, SEEN_BY_THE_PREPROCESSOR, skip_without

import torquer

FILES = ("adcs.c", "adcs_tables.c", "adcs_math.c", "adcs_ephemeris.c")
MAIN = '#include "adcs.h"\nint main(void)\n{\n    return adcs_self_test() ? 0 : 3;\n}\n'
PLAIN = [*FLAGS, "-O2", "-DADCS_PORTABLE"]
DANGEROUS = OTHERWISE | SEEN_BY_THE_PREPROCESSOR | {
    "Ofast": ["-Ofast"], "single": ["-fsingle-precision-constant"],
    "by GNU C": ["-std=gnu99", "-mfma", "-ffp-contract=fast"],
}  # fmt: skip
RIGHT = {
    "O3": ["-O3"], "O0": ["-O0"], "no errno": ["-fno-math-errno", "-fno-trapping-math"],
    "rounding": ["-frounding-math"],
}  # fmt: skip


def compiled(folder: Path, file: str, flags: list[str]) -> bytes | None:
    """The object file of a source, None if it does not compile."""
    out = folder / file.replace(".c", ".o")
    command = [COMPILER, *PLAIN, *flags, "-c", folder / file, "-o", out]
    made = subprocess.run(command, capture_output=True, text=True)
    if made.returncode:
        assert "#error" in made.stderr or "constants_are_doubles" in made.stderr, made.stderr
        return None
    return out.read_bytes()


def answer(folder: Path) -> int:
    """What a program of the objects says of its self-test."""
    objects = [folder / file.replace(".c", ".o") for file in FILES]
    command = [COMPILER, *PLAIN, f"-I{folder}", folder / "main.c", *objects]
    subprocess.run([*command, "-o", folder / "main", "-lm"], check=True)
    return subprocess.run([folder / "main"]).returncode


@pytest.fixture(scope="module", params=["double", "float"])
def export(request, tmp_path_factory) -> tuple[Path, dict[str, bytes]]:
    """An export of all files, and their objects as they should be."""
    folder = tmp_path_factory.mktemp("export")
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    torquer.export_c(scenario, folder, steps=1, real=request.param, ephemeris="kepler")
    (folder / "main.c").write_text(MAIN)
    return folder, {file: compiled(folder, file, []) or b"" for file in FILES}


@needs_compiler
@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("name", DANGEROUS)
def test_a_file_that_is_compiled_to_other_bits_is_noticed(export, name, file):
    """It does not compile, or the self-test fails, or its code is the same in spite of the flag."""
    skip_without(DANGEROUS[name])
    folder, right = export
    flags = DANGEROUS[name]
    same = compiled(folder, file, [*flags, PLAIN[1]]) if "-mfma" in flags else right[file]
    found = compiled(folder, file, flags)
    if found is not None and found != same:
        assert answer(folder) == 3
    (folder / file.replace(".c", ".o")).write_bytes(right[file])


@needs_compiler
@pytest.mark.parametrize("name", RIGHT)
def test_files_that_are_compiled_to_the_same_bits_pass(export, name):
    folder, right = export
    for file in FILES:
        assert compiled(folder, file, RIGHT[name])
    assert answer(folder) == 0
    for file in FILES:
        (folder / file.replace(".c", ".o")).write_bytes(right[file])
