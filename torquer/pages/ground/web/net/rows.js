// Rows of packets: handed to who listens; the newest of each packet is kept.

import { get, inBackground, route } from "./api.js";

/** How good a row is, by the number in it. */
export const QUALITIES = ["suspect", "unchecked", "authentic"];

/** Listeners and the newest row, by satellite and packet. */
export class Rows {
  #live;
  #listeners = new Map();
  #firsts = new Set();
  #newest = new Map();

  constructor(live) {
    this.#live = live;
    live.on("rows", (rows) => this.#received(rows.map(rowOf)));
    // What comes while there is no connection is newer, and in the archive only.
    live.on("connected", () => this.#newest.clear());
  }

  /** Calls `listener` with the rows of a message, of all satellites, before anybody else. */
  first(listener, signal = undefined) {
    this.#firsts.add(listener);
    signal?.addEventListener("abort", () => this.#firsts.delete(listener));
  }

  /** Calls `listener` with every new row of a packet; `arrived`: when, by `performance.now()`. */
  listen(satellite, packet, listener, signal) {
    const key = `${satellite}/${packet}`;
    if (!this.#listeners.has(key)) this.#listeners.set(key, new Set());
    this.#listeners.get(key).add(listener);
    signal.addEventListener("abort", () => this.#listeners.get(key).delete(listener));
  }

  /**
   * Calls `take` with the newest row of a packet and with each new one; the newest is that of the
   * archive if none has come since the connection was made.
   */
  async follow(satellite, packet, take, signal) {
    let arrived = -Infinity;
    const takeNewer = (row) => {
      if (!row || row.arrived < arrived) return;
      arrived = row.arrived;
      take(row);
    };
    const known = () => this.#newest.get(`${satellite}/${packet}`);
    const ask = async () => takeNewer(known() ?? (await archived(satellite, packet, signal)));
    this.listen(satellite, packet, takeNewer, signal);
    this.#live.on("again", () => inBackground(ask(), signal), signal);
    await ask();
  }

  #received(rows) {
    for (const listener of this.#firsts) listener(rows);
    for (const row of rows) {
      const key = `${row.satellite}/${row.packet}`;
      this.#newest.set(key, row);
      for (const listener of this.#listeners.get(key) ?? []) listener(row);
    }
  }
}

/** Infinities come by name: JSON has no numbers for them. */
const INFINITIES = new Map(["Infinity", "-Infinity"].map((name) => [name, Number(name)]));
export const numberOf = (value) => INFINITIES.get(value) ?? value;

function rowOf([satellite, packet, time, received, quality, sent]) {
  const values = sent.map(numberOf);
  return { satellite, packet, time, received, quality, values, arrived: performance.now() };
}

/** The newest row of a packet in the archive, or null. */
async function archived(satellite, packet, signal) {
  // On-board time may have been set back; rows of recordings have no time of reception.
  for (const by of ["received", "time"]) {
    const [row] = await frames(satellite, packet, { size: 1, by }, signal);
    // Times of reception are this machine's; rows of recordings have none: they came long ago.
    // That machine's clock may have been set: a row never comes from the future.
    const age = row && Math.max(0, Date.now() - (row.received ?? -Infinity));
    if (row) return { ...row, arrived: performance.now() - age };
  }
  return null;
}

/** The last rows of a packet, as they come live. */
export async function frames(satellite, packet, parameters, signal = undefined) {
  const rows = await get(route(satellite, "history", packet), parameters, signal);
  return rows.map(([time, received, quality, values]) =>
    rowOf([satellite, packet, time, received, quality, values]),
  );
}

/** Points `[time, received, value, quality]` of a number: rows, and gaps without a quality. */
export async function history(satellite, packet, number, parameters, signal = undefined) {
  const points = await get(route(satellite, "history", packet, number), parameters, signal);
  return points.map(([time, received, value, ...rest]) => [time, received, numberOf(value), ...rest]);
}
