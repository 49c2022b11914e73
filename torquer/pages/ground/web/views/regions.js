// States of the regions of the mode table, from the packet `modes`.

import { get, route } from "../net/api.js";
import { h } from "../dom.js";

const PACKET = "modes";
/** What the packet holds in place of a state where there is no region. */
const NO_REGION = 255;

/** Regions with their states, and the diagram. */
export const modesOf = (satellite, signal) => get(route(satellite.key, "modes"), {}, signal);

/** Calls `show` with the name of each region's state (null: unknown), now and at changes. */
export function followStates(regions, { satellite, rows, signal }, show) {
  const take = (row) => show(regions.map(({ states }, i) => stateOf(states, row.values[i])));
  return rows.follow(satellite.key, PACKET, take, signal);
}

function stateOf(states, value) {
  if (value === null || value === undefined || value === NO_REGION) return null;
  return states[value] ?? `state ${value}`;
}

/** A list "region: state"; `chosen(i)` is called when a region is clicked. */
export class RegionList {
  #states = [];

  constructor(regions, chosen = null) {
    const row = ({ name }, i) => {
      const state = h("td", { class: "t-regions__state is-unknown" }, "unknown");
      this.#states.push(state);
      const label = chosen && h("button", { type: "button", onclick: () => chosen(i) }, name);
      return h("tr", { "data-region": name }, h("th", { scope: "row" }, label ?? name), state);
    };
    const className = `t-table t-regions ${chosen ? "t-regions--active" : ""}`;
    this.element = h("table", { class: className }, h("tbody", {}, regions.map(row)));
  }

  show(states) {
    states.forEach((state, i) => {
      this.#states[i].textContent = state ?? "unknown";
      this.#states[i].classList.toggle("is-unknown", state === null);
    });
  }
}
