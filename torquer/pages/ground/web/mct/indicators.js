// The status line: a satellite each, with its link, counts and on-board time.

import { clockInWords } from "../clock_words.js";
import { every, h } from "../dom.js";
import { SatelliteClock } from "../net/satellite_clock.js";
import { zoneSwitch } from "../times.js";
import { askAgain } from "./clocks.js";
import { noTelemetry, notArchived, noWord } from "./trouble.js";

/** Counts that the status line shows where the server gives them, with their words. */
const COUNTS = { frames: "frames", rejected: "rejected", lost_bytes: "bytes lost" };

export function installIndicators(openmct, satellites, live, rows, watch) {
  const element = zoneSwitch(() => askAgain(openmct));
  openmct.indicators.add({ element, key: "torquer.zone", priority: openmct.priority.DEFAULT });
  for (const satellite of satellites.values()) {
    const indicator = new Indicator(satellite, new SatelliteClock(satellite, rows), watch);
    openmct.indicators.add({
      element: indicator.element,
      key: `torquer.flight.link.${satellite.key}`,
      priority: openmct.priority.HIGH,
    });
    live.on("links", (links) =>
      links
        .filter((link) => link.satellite === satellite.key)
        .forEach((one) => indicator.link(one)),
    );
    live.on("connected", (isConnected) => indicator.server(isConnected));
    const clock = openmct.time.getAllClocks().find(({ key }) => key === `onboard.${satellite.key}`);
    const show = () => indicator.show(clock.heard);
    live.on("links", show);
    watch.on(show);
    every(500, show, new AbortController().signal);
  }
}

class Indicator {
  #link = null;
  #watch;
  #hasServer = false;
  #clock;
  #state = h("span", { class: "t-link__state" });
  #archive = h("span", { class: "t-link__archive", role: "status" });
  #counts = h("span", { class: "t-link__counts" });
  #time = h("span", { class: "t-link__time" });

  constructor({ name }, clock, watch) {
    this.#clock = clock;
    this.#watch = watch;
    const title = h("span", { class: "t-link__name" }, name);
    const shown = [title, this.#state, this.#archive, this.#counts, this.#time];
    this.element = h("div", { class: "t-link" }, shown);
  }

  link(link) {
    this.#link = link;
  }

  server(isConnected) {
    this.#hasServer = isConnected;
    if (!isConnected) this.#link = null;
  }

  show(time) {
    const [state, text] = this.#stateInWords();
    this.element.dataset.state = state;
    this.#state.textContent = text;
    this.#archive.textContent = notArchived(this.#link);
    this.#counts.textContent = countsInWords(this.#link);
    this.#time.textContent = clockInWords(time, this.#clock);
    this.element.title = this.#link?.address ?? "";
  }

  #stateInWords() {
    if (this.#watch.since !== null) return ["lost", noWord(this.#watch)];
    if (!this.#hasServer) return ["lost", "no connection to the server"];
    if (!this.#link) return ["lost", "link unknown"];
    if (!this.#link.connected) return ["lost", "link lost"];
    if (this.#link.silent) return ["silent", noTelemetry(this.#link)];
    return ["connected", "link up"];
  }
}

/** Counts by reason are shown as their sum; what never was is not said. */
function countsInWords(link) {
  const sum = (count) =>
    typeof count === "object" ? Object.values(count).reduce((a, b) => a + b, 0) : count;
  return Object.entries(COUNTS)
    .map(([key, word]) => [sum(link?.[key] ?? 0), word])
    .filter(([count]) => count)
    .map((parts) => parts.join(" "))
    .join(", ");
}
