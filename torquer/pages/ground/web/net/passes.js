// Passes of satellites: asked for once a minute, by the clock by which they go.

import { get, route } from "./api.js";

const AGAIN_MS = 60_000;
const sources = new Map();

/** The source of a satellite's passes; there is one for the whole page. */
export function passesOf(satellite, openmct) {
  if (!sources.has(satellite.key)) sources.set(satellite.key, new Passes(satellite, openmct));
  return sources.get(satellite.key);
}

/** What is known of passes: `found` as the server gave it last, or `failure`, in a line. */
class Passes {
  found = null;
  failure = "";
  #satellite;
  #openmct;
  #askedAt = 0;
  #listeners = new Set();

  constructor(satellite, openmct) {
    this.#satellite = satellite;
    this.#openmct = openmct;
    this.#ask();
    setInterval(() => this.#ask(), AGAIN_MS);
  }

  /** Calls `listener` for each answer, until the signal says stop. */
  follow(listener, signal) {
    this.#listeners.add(listener);
    signal.addEventListener("abort", () => this.#listeners.delete(listener));
    if (this.found || this.failure) listener();
  }

  /**
   * The time now [ms], by the clock by which passes go: this machine's, or that of a satellite of
   * another epoch. The latter goes on in real time while nothing is heard of it.
   */
  now() {
    if (!this.found) return null;
    const here = this.found.now_ms + performance.now() - this.#askedAt;
    if (this.found.clock !== "satellite") return here;
    const key = `onboard.${this.#satellite.key}`;
    const clock = this.#openmct.time.getAllClocks().find((one) => one.key === key);
    return Math.max(here, clock?.currentValue() ?? here);
  }

  /** The pass that goes on, else the next one; null for none. */
  next() {
    const now = this.now();
    return this.found?.passes.find(({ los }) => los.time_ms > now) ?? null;
  }

  async #ask() {
    try {
      this.found = await get(route(this.#satellite.key, "passes"));
      this.#askedAt = performance.now();
      this.failure = "";
    } catch (error) {
      this.found = null;
      this.failure = error.message;
    }
    for (const listener of this.#listeners) listener();
  }
}

/** Text of a span of time: days, hours, minutes and seconds, of which two are shown. */
export function spanInWords(milliseconds) {
  const seconds = Math.max(0, Math.round(milliseconds / 1000));
  const [days, hours] = [Math.floor(seconds / 86_400), Math.floor(seconds / 3600) % 24];
  const [minutes, rest] = [Math.floor(seconds / 60) % 60, seconds % 60];
  const two = (number) => String(number).padStart(2, "0");
  if (days) return `${days} d ${two(hours)} h`;
  if (hours) return `${hours} h ${two(minutes)} min`;
  return minutes ? `${minutes} min ${two(rest)} s` : `${rest} s`;
}

/** What a satellite has in a station's sky at a time: a point between two of a pass's curve. */
export function skyAt({ curve }, time) {
  const after = curve.findIndex(([at]) => at >= time);
  if (after < 1) return null;
  const [a, b] = [curve[after - 1], curve[after]];
  const part = (time - a[0]) / (b[0] - a[0] || 1);
  const between = (k) => (a[k] === null ? null : a[k] + part * (b[k] - a[k]));
  const turn = ((b[1] - a[1] + 540) % 360) - 180;
  return {
    azimuth: (a[1] + part * turn + 360) % 360,
    elevation: between(2),
    range: between(3),
    doppler: between(4),
    sunlit: a[5],
  };
}
