// Plots and the 3D view by keys alone, and in words for who does not see them.

import { t } from "./words.js";

/** Part of a plot's records by which an arrow key moves. */
const STEP = 0.01;
const MOVES = { ArrowLeft: -STEP, ArrowRight: STEP, PageDown: -10 * STEP, PageUp: 10 * STEP };
const ENDS = { Home: 0, End: 1 };

/** Calls `work` and nothing else where one of the keys is pressed. */
function onKeys(element, table, work) {
  element.addEventListener("keydown", (event) => {
    if (!(event.key in table) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    work(event.key);
  });
}

/** Lets keys move the time of a plot, which then is said with its values, and toggle its lines. */
export function plotByKeys(chart, panel) {
  const { over } = chart;
  const count = () => chart.data[0].length;
  over.tabIndex = 0;
  const about = { role: "slider", "aria-label": t("time of {plot}", { plot: panel.title }), "aria-valuemin": 0 };
  for (const [name, value] of Object.entries(about)) over.setAttribute(name, value);
  const say = () => {
    const i = Math.min(chart.cursor.idx ?? Infinity, count() - 1);
    over.setAttribute("aria-valuemax", count() - 1);
    over.setAttribute("aria-valuenow", i);
    over.setAttribute("aria-valuetext", valuesAt(chart, i, panel.unit));
  };
  onKeys(over, { ...MOVES, ...ENDS }, (key) => {
    const last = count() - 1;
    const now = chart.cursor.idx ?? last;
    const moved = now + (Math.round(MOVES[key] * last) || Math.sign(MOVES[key]));
    const i = key in ENDS ? ENDS[key] * last : Math.min(Math.max(moved, 0), last);
    chart.setCursor({ left: chart.valToPos(chart.data[0][i], "x"), top: 0 });
    say();
  });
  say();
  (chart.hooks.setData ??= []).push(say);
  chart.root.querySelectorAll(".u-series").forEach((row, i) => i && lineByKeys(chart, row, i));
}

function valuesAt(chart, i, unit) {
  const shown = chart.series.slice(1).flatMap(({ label, show }, k) => {
    const value = chart.data[k + 1][i];
    return show && Number.isFinite(value) ? [`${label} ${Number(value.toPrecision(3))} ${unit}`] : [];
  });
  return [`${chart.data[0][i]?.toFixed(2)} ${t("h")}`, ...shown].join(", ");
}

function lineByKeys(chart, row, i) {
  const name = row.querySelector(".u-label");
  name.tabIndex = 0;
  name.setAttribute("role", "button");
  const say = () => name.setAttribute("aria-pressed", chart.series[i].show !== false);
  onKeys(name, { Enter: true, " ": true }, () => name.click());
  name.addEventListener("click", () => setTimeout(say));
  say();
}

/** Angle by which an arrow key turns the 3D view [rad]. */
const TURN = Math.PI / 18;
const TURNS = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN] };

/** Lets arrow keys turn the 3D view; `turn(around, over)` turns it by angles [rad]. */
export function viewByKeys(canvas, turn) {
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", t("attitude of the body in inertial axes; arrow keys turn the view"));
  onKeys(canvas, TURNS, (key) => turn(...TURNS[key]));
}
