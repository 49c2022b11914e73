// Satellites side by side: the main values of each, with its own clock.

import { clockInWords } from "../clock_words.js";
import { every, h } from "../dom.js";
import { SatelliteClock } from "../net/satellite_clock.js";
import { inZone } from "../times.js";
import { showState } from "./state.js";

/** How many are shown at first. */
const FIRST = 2;

export async function showSatellites(element, context) {
  const { object, openmct, satellites, signal } = context;
  const all = [...satellites.values()];
  const columns = all.map((satellite, i) => columnOf(satellite, i < FIRST, context));
  const choices = columns.map(({ box, satellite }) => {
    const shown = h("input", { type: "checkbox", checked: !box.hidden });
    shown.onchange = () => (box.hidden = !shown.checked);
    return h("label", {}, shown, ` ${satellite.name}`);
  });
  const plots = h(
    "select",
    { "aria-label": "Plot of a number of both" },
    h("option", { value: "" }, "compare a number …"),
    object.plots.map(({ path, name }) => h("option", { value: path }, name)),
  );
  plots.onchange = () => plots.value && openmct.router.navigate(plots.value);
  const ground = h("span", { class: "t-note" });
  every(500, () => (ground.textContent = `Ground: ${inZone(Date.now())}`), signal);
  element.append(
    h(
      "div",
      { class: "t-side" },
      h("div", { class: "t-bar t-bar--wraps" }, choices, plots, ground),
      h("div", { class: "t-side__columns t-scroll", tabindex: 0 }, columns.map(({ box }) => box)),
    ),
  );
  await Promise.all(columns.map(({ start }) => start()));
}

function columnOf(satellite, isShown, context) {
  const { openmct, rows, signal } = context;
  const time = h("p", { class: "t-side__clock" });
  const state = h("div");
  const box = h(
    "section",
    { "aria-label": satellite.name, "data-satellite": satellite.key, hidden: !isShown },
    h("h2", { class: "t-side__name" }, satellite.name),
    time,
    state,
  );
  const clock = new SatelliteClock(satellite, rows, signal);
  const onBoard = openmct.time.getAllClocks().find(({ key }) => key === `onboard.${satellite.key}`);
  const show = () => {
    time.textContent = clockInWords(onBoard.heard, clock);
  };
  every(500, show, signal);
  return { box, satellite, start: () => showState(state, { ...context, satellite }) };
}
