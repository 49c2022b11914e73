// Alarms of all satellites: asked for once, then kept by messages.

import { get, inBackground, post, route } from "./api.js";

const NONE = { alarm: 0, warning: 0, shelved: 0, all: 0 };

/** `listen(listener)`: called with what has changed, a list of alarms with their satellites. */
export class AlarmStore {
  #satellites;
  #known = new Map();
  #listeners = new Set();
  #asked = new Set();
  #missed = new Set();

  constructor(satellites, live) {
    this.#satellites = satellites;
    for (const key of satellites.keys())
      this.#known.set(key, { version: null, counts: NONE, alarms: new Map() });
    live.on("alarms", (messages) => messages.forEach((message) => this.#take(message)));
    live.on("again", () => this.askAll());
    live.on("connected", (isConnected) => isConnected || this.#forget());
  }

  /** Whether the alarms are those of now: without a connection nobody knows. */
  get isKnown() {
    return [...this.#known.values()].every(({ version }) => version !== null);
  }

  askAll() {
    for (const key of this.#satellites.keys()) this.#ask(key);
  }

  listen(listener, signal = undefined) {
    this.#listeners.add(listener);
    signal?.addEventListener("abort", () => this.#listeners.delete(listener));
  }

  /** Alarms of a satellite, or of all. */
  list(satellite = null) {
    const keys = satellite === null ? [...this.#known.keys()] : [satellite];
    return keys.flatMap((key) => [...this.#known.get(key).alarms.values()]);
  }

  /** How many call for somebody, by severity, and how many are shelved, of all satellites. */
  counts() {
    const all = [...this.#known.values()].map(({ counts }) => counts);
    const sum = (name) => all.reduce((total, counts) => total + counts[name], 0);
    return { alarm: sum("alarm"), warning: sum("warning"), shelved: sum("shelved") };
  }

  acknowledge(alarms, comment) {
    const keys = [...new Set(alarms.map(({ satellite }) => satellite))];
    return Promise.all(
      keys.map((satellite) => {
        const some = alarms.filter((one) => one.satellite === satellite);
        const seen = some.map(({ key, number, state }) => ({ key, number, state }));
        return post(route(satellite, "alarms", "acknowledge"), { alarms: seen, comment });
      }),
    );
  }

  shelve({ satellite, key }, seconds, reason) {
    return post(route(satellite, "alarms", "shelve"), { key, for_s: seconds, reason });
  }

  unshelve({ satellite, key }) {
    return post(route(satellite, "alarms", "unshelve"), { key });
  }

  #ask(satellite) {
    if (this.#asked.has(satellite)) {
      this.#missed.add(satellite);
      return;
    }
    this.#asked.add(satellite);
    const { signal } = new AbortController();
    const asked = get(route(satellite, "alarms"))
      .then((found) => {
        const known = this.#known.get(satellite);
        const alarms = found.alarms.map((one) => [one.key, { satellite, ...one }]);
        Object.assign(known, { ...found, alarms: new Map(alarms) });
        this.#tell(known.alarms.values());
      })
      .finally(() => {
        this.#asked.delete(satellite);
        // What has changed since the answer was made may not be in it.
        if (this.#missed.delete(satellite)) this.#ask(satellite);
      });
    inBackground(asked, signal);
  }

  #forget() {
    for (const known of this.#known.values()) known.version = null;
    this.#tell([]);
  }

  #take({ satellite, version, counts, alarms }) {
    const known = this.#known.get(satellite);
    if (!known || version <= known.version) return;
    // A message was dropped, or nothing is known yet: the whole list is asked for.
    if (known.version === null || version > known.version + 1) {
      this.#ask(satellite);
      return;
    }
    Object.assign(known, { version, counts });
    const changed = alarms.map((one) => ({ satellite, ...one }));
    for (const one of changed) {
      if (one.state || one.shelf) known.alarms.set(one.key, one);
      else known.alarms.delete(one.key);
    }
    this.#tell(changed);
  }

  #tell(changed) {
    const list = [...changed];
    for (const listener of this.#listeners) listener(list);
  }
}
