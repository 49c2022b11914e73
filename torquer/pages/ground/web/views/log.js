// The log of satellite and ground: history, and what comes.

import { h, oncePerFrame } from "../dom.js";
import { get, inBackground, route } from "../net/api.js";
import { inZone } from "../times.js";

/** Most entries shown; older ones are found with a fixed time span. */
const MOST = 500;
const SEVERITIES = ["info", "warning", "alarm"];

export function showLog(element, context) {
  const log = new Log(context);
  element.append(log.element);
  return log.start();
}

class Log {
  #context;
  #entries = new Map();
  #least = h(
    "select",
    { "aria-label": "Severity", onchange: () => this.#draw() },
    h("option", { value: 0 }, "all entries"),
    h("option", { value: 1 }, "warnings and alarms"),
    h("option", { value: 2 }, "alarms"),
  );
  #text = h("input", { type: "search", placeholder: "text", "aria-label": "Text", oninput: () => this.#draw() });
  #span = h("span", { class: "t-note" });
  #body = h("tbody");

  constructor(context) {
    this.#context = context;
    this.element = h(
      "div",
      { class: "t-log" },
      h("div", { class: "t-bar" }, this.#least, this.#text, this.#span),
      h("div", { class: "t-scroll", tabindex: 0 }, this.#table()),
    );
    this.redraw = oncePerFrame(() => this.#draw(), context.signal);
  }

  async start() {
    const { live, openmct, satellite, signal } = this.#context;
    // A fixed time span is history: what comes now is not part of it.
    const isWanted = (one) => one.satellite === satellite.key && !openmct.time.isFixed();
    live.on("log", (entries) => this.#add(entries.filter(isWanted)), signal);
    const askAgain = () => inBackground(this.#ask(), signal);
    live.on("again", askAgain, signal);
    const onBounds = (bounds, isTick) => isTick || askAgain();
    openmct.time.on("boundsChanged", onBounds);
    signal.addEventListener("abort", () => openmct.time.off("boundsChanged", onBounds));
    await this.#ask();
  }

  #table() {
    const titles = ["Ground time", "On-board time", "Source", "Severity", "Text"];
    const head = h(
      "tr",
      {},
      titles.map((title) => h("th", { scope: "col" }, title)),
    );
    return h("table", { class: "t-table" }, h("thead", {}, head), this.#body);
  }

  /** The last entries, or those of a fixed time span. */
  async #ask() {
    const { openmct, satellite, signal } = this.#context;
    const isFixed = openmct.time.isFixed();
    const { start, end } = openmct.time.getBounds();
    const span = isFixed ? { start: Math.floor(start), end: Math.ceil(end) } : {};
    const found = await get(route(satellite.key, "log"), { ...span, size: MOST }, signal);
    this.#entries.clear();
    this.#span.textContent = isFixed ? "of the fixed time span" : "newest first, live";
    this.#add(found);
  }

  #add(entries) {
    for (const entry of entries) this.#entries.set(entry.id, entry);
    if (this.#entries.size > MOST) {
      const kept = this.#sorted().slice(0, MOST);
      this.#entries = new Map(kept.map((entry) => [entry.id, entry]));
    }
    this.redraw();
  }

  #sorted() {
    const at = ({ received_ms, time_ms }) => received_ms ?? time_ms;
    return [...this.#entries.values()].sort((a, b) => at(b) - at(a));
  }

  #draw() {
    const least = Number(this.#least.value);
    const text = this.#text.value.toLowerCase();
    const isWanted = (entry) =>
      SEVERITIES.indexOf(entry.severity) >= least && entry.text.toLowerCase().includes(text);
    this.#body.replaceChildren(...this.#sorted().filter(isWanted).map(lineOf));
  }
}

function lineOf({ received_ms, time_ms, source, severity, text }) {
  // The ground has no on-board time of its own.
  const onBoard = source === "satellite" ? inZone(time_ms) : "";
  const cells = [inZone(received_ms), onBoard, source, severity, text];
  return h(
    "tr",
    { "data-severity": severity },
    cells.map((cell) => h("td", {}, cell)),
  );
}
