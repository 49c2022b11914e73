// State at a glance: regions of the mode table and the single numbers of the main packet.

import { h } from "../dom.js";
import { followStates, modesOf, RegionList } from "./regions.js";
import { showValues } from "./values.js";

/** The packet whose numbers are shown: this one, else the first. */
const MAIN = "extended";

export function showState(element, context) {
  const { satellite } = context;
  const [modes, values] = [h("section"), h("section")];
  element.append(h("div", { class: "t-scroll", tabindex: 0 }, modes, values));
  return Promise.all([
    satellite.has.modes ? showRegions(modes, context) : null,
    showNumbers(values, context),
  ]);
}

async function showRegions(box, context) {
  const { regions } = await modesOf(context.satellite, context.signal);
  const list = new RegionList(regions);
  box.append(h("h2", { class: "t-heading" }, "Modes"), list.element);
  await followStates(regions, context, (states) => list.show(states));
}

function showNumbers(box, context) {
  const { packets } = context.satellite;
  const packet = packets.get(MAIN) ?? [...packets.values()][0];
  const inVectors = new Set([...packet.vectors.values()].flat());
  const single = packet.numbers.filter((one) => !inVectors.has(one));
  box.append(h("h2", { class: "t-heading" }, "Telemetry"));
  return showValues(box, context, packet, single, false);
}
