// The websocket: messages by kind, connected again after a loss.

import { isKnownHere } from "./api.js";

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 15_000;

/**
 * Listeners of kinds of messages: `rows`, `log`, `commands`, `links`, `beat` get the list of a message,
 * `connected` true or false, `refused` whether a server is there that does not know this page, as one
 * that was started again, and `again` is called after every connection but the first, and after a
 * silence: what came in between has to be asked for.
 */
export class Live {
  #listeners = new Map();
  #wait = FIRST_WAIT_MS;
  #connections = 0;
  connected = false;

  /** Listens until the signal says stop. */
  on(kind, listener, signal = undefined) {
    if (!this.#listeners.has(kind)) this.#listeners.set(kind, new Set());
    this.#listeners.get(kind).add(listener);
    signal?.addEventListener("abort", () => this.#listeners.get(kind).delete(listener));
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/api/live`);
    socket.onopen = () => this.#opened();
    socket.onmessage = (event) => this.#received(JSON.parse(event.data));
    socket.onclose = () => this.#closed();
  }

  /** Lets everybody ask again for what may have been missed. */
  askAgain() {
    this.#tell("again", true);
  }

  #opened() {
    this.#wait = FIRST_WAIT_MS;
    this.#tell("connected", (this.connected = true));
    if (this.#connections++) this.askAgain();
  }

  #received(message) {
    for (const [kind, list] of Object.entries(message)) this.#tell(kind, list);
  }

  #closed() {
    if (this.connected) this.#tell("connected", (this.connected = false));
    isKnownHere().then((isKnown) => this.#tell("refused", isKnown === false));
    // Pages that lost the same server do not all return at the same moment.
    setTimeout(() => this.connect(), this.#wait * (0.75 + Math.random() / 2));
    this.#wait = Math.min(2 * this.#wait, LONGEST_WAIT_MS);
  }

  #tell(kind, value) {
    for (const listener of this.#listeners.get(kind) ?? []) {
      // One view that fails must not keep telemetry from the others.
      try {
        listener(value);
      } catch (error) {
        console.error(error);
      }
    }
  }
}
