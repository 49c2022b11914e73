// Rows of an instant of the past, for views that follow the newest rows.

import { get, route } from "./api.js";
import { numberOf } from "./rows.js";

/** What was known at an instant: `{ time, by, state, packets }`, infinities as numbers. */
export async function knownAt(satellite, time, by, signal) {
  const found = await get(route(satellite.key, "past"), { time, by }, signal);
  for (const one of found.packets)
    for (const [name, value] of Object.entries(one.values)) one.values[name] = numberOf(value);
  return found;
}

/** Stands for `Rows` where a view is to show an instant. */
export class PastRows {
  #rows;

  constructor(satellite, { packets }) {
    this.#rows = new Map(packets.map((one) => [one.packet, rowOf(satellite, one)]));
  }

  /** Nothing comes after an instant of the past. */
  listen() {}

  async follow(satellite, packet, take) {
    const row = this.#rows.get(packet);
    if (row) take(row);
  }
}

function rowOf(satellite, { packet, time_ms, received_ms, quality, stale, values }) {
  const { numbers } = satellite.packets.get(packet);
  return {
    satellite: satellite.key,
    packet,
    time: time_ms,
    received: received_ms,
    quality,
    values: numbers.map(({ key }) => values[key]),
    // Its age is that at the instant, and does not grow.
    arrived: stale ? -Infinity : Infinity,
  };
}
