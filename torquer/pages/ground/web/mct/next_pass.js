// The status line's word on the next pass of each satellite that has stations.

import { every, h } from "../dom.js";
import { passesOf, spanInWords } from "../net/passes.js";

export function installNextPass(openmct, satellites) {
  for (const satellite of satellites.values()) {
    if (!satellite.has.passes) continue;
    const passes = passesOf(satellite, openmct);
    const element = h("div", { class: "t-link t-next", "data-satellite": satellite.key });
    openmct.indicators.add({
      element,
      key: `torquer.passes.${satellite.key}`,
      priority: openmct.priority.HIGH,
    });
    every(1000, () => show(element, satellite, passes), new AbortController().signal);
  }
}

function show(element, satellite, passes) {
  const [state, text] = inWords(passes);
  element.dataset.pass = state;
  const whole = `${satellite.name}: ${text}`;
  if (element.textContent !== whole) element.textContent = whole;
  element.title = passes.failure || passes.found?.orbit || "";
}

function inWords(passes) {
  if (passes.failure) return ["unknown", "passes unknown"];
  if (!passes.found) return ["unknown", "passes …"];
  const [next, now] = [passes.next(), passes.now()];
  if (!next) return ["none", "no pass within a day"];
  const height = `${next.highest.elevation_deg.toFixed(0)}°`;
  if (next.aos.time_ms <= now)
    return ["now", `pass over ${next.station}, LOS in ${spanInWords(next.los.time_ms - now)}`];
  return ["next", `${next.station} in ${spanInWords(next.aos.time_ms - now)}, ${height}`];
}
