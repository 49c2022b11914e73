// Orbit, Sun and field by the model on the ground, for the time of the newest telemetry.

import { get, route } from "../net/api.js";

const PAUSE_MS = 1000;

/** Asks at most once a second, for the last time that it was given. */
export class OrbitSource {
  #satellite;
  #signal;
  #found;
  #wanted = null;
  #busy = false;

  constructor(satellite, signal, found) {
    this.#satellite = satellite;
    this.#signal = signal;
    this.#found = found;
  }

  at(time) {
    this.#wanted = time;
    if (!this.#busy) this.#ask();
  }

  async #ask() {
    const time = this.#wanted;
    this.#wanted = null;
    this.#busy = true;
    const pause = new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    try {
      const path = route(this.#satellite, "orbit");
      this.#found(await get(path, { time: Math.round(time) }, this.#signal));
    } catch (error) {
      if (!this.#signal.aborted) console.warn(error);
    }
    await pause;
    this.#busy = false;
    if (this.#wanted !== null && !this.#signal.aborted) this.#ask();
  }
}
