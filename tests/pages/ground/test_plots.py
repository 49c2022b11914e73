"""Plots: lines with gaps, marks for infinities, history that begins with a number."""

import json
import shutil
import subprocess

import pytest

pytest.importorskip("uvicorn")

from torquer.pages.ground.routes import WEB

NODE = shutil.which("node")
CANVAS = """
const calls = [];
const isNumber = (x) => typeof x === "number";
const note = (name) => (...given) => calls.push([name, ...given.filter(isNumber)]);
globalThis.Path2D = class { moveTo = note("mark"); lineTo() {} closePath() {} };
class Context {
  canvas = { height: 100 };
  moveTo(...at) { note("move")(...at); }
  lineTo(...at) { note("line")(...at); }
  stroke() { note("stroke")(); }
  fill() { note("fill")(); }
  fillRect(...at) { note("dot")(...at); }
}
const made = new Context();
globalThis.HTMLCanvasElement = class {
  constructor(name) { this.classList = { contains: (asked) => asked === name }; }
  getContext(kind) { return kind === "2d" ? made : { kind }; }
};
"""
DRAWING = """
drawPlotsIn2D();
const plot = new HTMLCanvasElement("js-main-canvas");
const [webgl, other] = [plot, new HTMLCanvasElement("other")].map((c) => c.getContext("webgl"));
const context = plot.getContext("2d");
plot.getContext("2d");
context.moveTo(0, 1);
for (const [x, y] of [[1, 2], [2, NaN], [3, 4], [4, 5], [5, -Infinity], [6, 7], [7, Infinity]])
  context.lineTo(x, y);
context.stroke();
console.log(JSON.stringify({ calls, webgl, other }));
"""


@pytest.mark.skipif(NODE is None, reason="no Node.js")
def test_lines_are_interrupted_and_infinities_marked():
    code = CANVAS + (WEB / "mct" / "plots.js").read_text(encoding="utf-8") + DRAWING
    call = [NODE, "--input-type=module"]
    done = subprocess.run(call, input=code, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["webgl"] is None and found["other"] == {"kind": "webgl"}
    assert found["calls"] == [
        ["move", 0, 1],
        ["line", 1, 2],
        ["move", 3, 4],
        ["line", 4, 5],
        ["move", 6, 7],
        ["stroke"],
        ["mark", 5, 0],
        ["fill"],
        ["mark", 7, 100],
        ["fill"],
        ["dot", 4, 5, 4, 4],
    ]


HANDED = """
const points = JSON.parse(process.argv[1]).map(([at, value]) => [at, at, numberOf(value), 2]);
const shown = withOrigin(oneOfEachRun(points), { start: 0, end: 100 });
console.log(JSON.stringify(shown.map(([at, , value]) => [at, String(value)])));
"""
NUMBER_OF = "const numberOf = (value) => (typeof value === 'string' ? Number(value) : value);"


@pytest.mark.skipif(NODE is None, reason="no Node.js")
@pytest.mark.parametrize(
    ("points", "handed"),
    [
        ([], []),
        ([[1, 5], [2, None], [3, 6]], [[1, "5"], [2, "null"], [3, "6"]]),
        # of a run an infinity rather than a gap
        ([[1, 5], [2, None], [3, "Infinity"], [4, 6]], [[1, "5"], [3, "Infinity"], [4, "6"]]),
        ([[1, 5], [2, "-Infinity"], [3, None], [4, 6]], [[1, "5"], [2, "-Infinity"], [4, "6"]]),
        # an origin far away, where a history does not begin with a number
        ([[1, "Infinity"], [2, 7]], [[-9999, "7"], [1, "Infinity"], [2, "7"]]),
        ([[1, "Infinity"], [2, "Infinity"]], [[-9999, "0"], [1, "Infinity"]]),
        ([[1, None], [2, 7]], [[-9999, "7"], [1, "null"], [2, "7"]]),
    ],
)
def test_what_plots_are_handed_of_values_that_are_not_finite(points, handed):
    code = NUMBER_OF + (WEB / "mct" / "places.js").read_text(encoding="utf-8") + HANDED
    call = [NODE, "--input-type=module", "-e", code, json.dumps(points)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == handed
