// Whether what is shown is of now: the ground reports each second, and the page knows when it did.

import { every } from "../dom.js";

/** Time between two reports, and two looks at them, allowed before a silence is told [ms]. */
const SILENT_MS = 2200;
const LOOK_MS = 250;
/** A look that comes so late finds reports that the browser has not handed over yet [ms]. */
const LATE_MS = 1500;
/** Time that a page has until the first report [ms]. */
const START_MS = 5000;

/**
 * `since`: the time of the last report [ms] where none comes any more, else null; `isRefused`: a
 * ground is there, but does not know this page, as one that was started again. After a silence,
 * and after rows that the server dropped for a slow page, history is asked for again.
 */
export class Watch {
  #live;
  #heard = performance.now() + START_MS;
  #heardAt = Date.now();
  #looked = performance.now();
  #listeners = new Set();
  #failing = new Set();
  #dropped = 0;
  #isBehind = false;
  #isAskedAgain = false;
  since = null;
  isRefused = false;

  constructor(live) {
    this.#live = live;
    live.on("beat", (beats) => this.#hear(beats.at(-1)));
    live.on("links", (links) => links.forEach((link) => this.#archive(link)));
    live.on("connected", (isConnected) => this.#connect(isConnected));
    live.on("refused", (isRefused) => this.#refuse(isRefused));
    live.on("again", () => (this.#isAskedAgain = true));
    every(LOOK_MS, () => this.#look(), new AbortController().signal);
  }

  /** Calls `listener` whenever one of them changes. */
  on(listener) {
    this.#listeners.add(listener);
  }

  /** Where there is no connection no word can come: that is not waited for. */
  #connect(isConnected) {
    this.#dropped = 0;
    if (!isConnected) this.#tell(this.#heardAt);
  }

  #refuse(isRefused) {
    if (isRefused || this.since !== null) this.#tell(this.since ?? this.#heardAt, isRefused);
  }

  #hear({ dropped }) {
    const wasSilent = this.since !== null || this.#silence() > SILENT_MS;
    this.#heard = performance.now();
    this.#heardAt = Date.now();
    this.#tell(null);
    // A slow page is not helped by more requests: only once it keeps up again.
    const isBehind = dropped > this.#dropped;
    const hasCaughtUp = this.#isBehind && !isBehind;
    [this.#dropped, this.#isBehind] = [dropped, isBehind];
    if ((wasSilent && !this.#isAskedAgain) || hasCaughtUp) this.#live.askAgain();
    this.#isAskedAgain = false;
  }

  /** What waited for the archive is in it now: those who asked meanwhile have not got it. */
  #archive({ satellite, not_archived_since_ms: since }) {
    if (since !== null) this.#failing.add(satellite);
    else if (this.#failing.delete(satellite)) this.#live.askAgain();
  }

  /** Timers of a computer that slept may not know of it; its clock does. */
  #silence() {
    const byClock = this.#heard < performance.now() ? Date.now() - this.#heardAt : 0;
    return Math.max(performance.now() - this.#heard, byClock);
  }

  #look() {
    const now = performance.now();
    const isLate = now - this.#looked > LATE_MS;
    this.#looked = now;
    if (!isLate && this.#silence() > SILENT_MS) this.#tell(this.#heardAt);
  }

  #tell(since, isRefused = since !== null && this.isRefused) {
    if (since === this.since && isRefused === this.isRefused) return;
    [this.since, this.isRefused] = [since, isRefused];
    for (const listener of this.#listeners) listener();
  }
}
