// The log of satellite and ground: searched in the whole archive, and what comes.

import { h, oncePerFrame } from "../dom.js";
import { get, inBackground, route } from "../net/api.js";
import { inZone } from "../times.js";
import { titledLine } from "./titled.js";

/** Most entries shown, and in a file; pause after the last key before the archive is asked [ms]. */
const MOST = 500;
const MOST_IN_FILE = 20_000;
const PAUSE_MS = 300;
const SEVERITIES = ["info", "warning", "alarm"];
const TITLES = ["Ground time", "On-board time", "Source", "Severity", "Text"];

export function showLog(element, context) {
  const log = new Log(context);
  element.append(log.element);
  return log.start();
}

class Log {
  #context;
  #entries = new Map();
  #asked = 0;
  #due = null;
  #severity = choice("Least severity", [
    ["info", "all severities"],
    ["warning", "warnings and alarms"],
    ["alarm", "alarms"],
  ]);
  #source = choice("Source", [
    ["", "satellite and ground"],
    ["satellite", "satellite"],
    ["ground", "ground"],
  ]);
  #text = h("input", { type: "search", placeholder: "text", maxLength: 200, "aria-label": "Text" });
  #from = timeInput("From (on board, UTC)");
  #to = timeInput("To (on board, UTC)");
  #file = h("a", { class: "t-log__file", download: "" }, "CSV");
  #note = h("span", { class: "t-note", role: "status" });
  #body = h("tbody");

  constructor(context) {
    this.#context = context;
    const filters = [this.#severity, this.#source, this.#text, this.#from, this.#to];
    for (const one of filters) one.addEventListener("input", () => this.#later());
    const labels = [h("label", {}, "from ", this.#from), h("label", {}, "to ", this.#to)];
    this.element = h(
      "div",
      { class: "t-log t-folds" },
      h("div", { class: "t-bar" }, filters.slice(0, 3), labels, this.#file, this.#note),
      h("div", { class: "t-scroll", tabIndex: 0 }, this.#table()),
    );
    this.redraw = oncePerFrame(() => this.#draw(), context.signal);
  }

  async start() {
    const { live, openmct, satellite, signal } = this.#context;
    const isWanted = (one) => one.satellite === satellite.key && this.#isLive() && this.#has(one);
    live.on("log", (entries) => this.#add(entries.filter(isWanted)), signal);
    const askAgain = () => inBackground(this.#ask(), signal);
    live.on("again", askAgain, signal);
    const onBounds = (bounds, isTick) => isTick || askAgain();
    openmct.time.on("boundsChanged", onBounds);
    signal.addEventListener("abort", () => openmct.time.off("boundsChanged", onBounds));
    signal.addEventListener("abort", () => clearTimeout(this.#due));
    await this.#ask();
  }

  #table() {
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    return h("table", { class: "t-table t-log__lines" }, h("thead", {}, h("tr", {}, head)), this.#body);
  }

  #later() {
    this.#pointFile();
    clearTimeout(this.#due);
    this.#due = setTimeout(() => inBackground(this.#ask(), this.#context.signal), PAUSE_MS);
  }

  /** What comes now belongs to a span without an end only. */
  #isLive() {
    return !this.#context.openmct.time.isFixed() && !this.#to.value;
  }

  /** What is asked for: the filters, and a fixed time span where the view has none of its own. */
  #query() {
    const { time } = this.#context.openmct;
    const bounds = time.isFixed() ? time.getBounds() : {};
    const start = timeOf(this.#from) ?? bounds.start;
    const end = timeOf(this.#to) ?? bounds.end;
    return {
      severity: this.#severity.value,
      source: this.#source.value,
      text: this.#text.value,
      start: start === undefined ? undefined : Math.floor(start),
      end: end === undefined ? undefined : Math.ceil(end),
    };
  }

  /** The file answers to the filters as they stand, also while the archive is not yet asked. */
  #pointFile() {
    const asked = { ...this.#query(), size: MOST_IN_FILE };
    this.#file.href = addressOf(route(this.#context.satellite.key, "log.csv"), asked);
  }

  async #ask() {
    const { satellite, signal } = this.#context;
    const query = this.#query();
    this.#pointFile();
    const number = ++this.#asked;
    const path = route(satellite.key, "log", "search");
    // A refusal is said in place of entries: old ones would be taken for what was asked for.
    const refused = ({ message }) => ({ entries: [], failure: message });
    const found = await get(path, { ...query, size: MOST }, signal).catch(refused);
    // An answer to a later question may come before this one.
    if (number !== this.#asked || signal.aborted) return;
    this.#entries.clear();
    this.#note.textContent = found.failure ?? this.#spanInWords(found);
    this.#add(found.entries);
  }

  #spanInWords({ complete }) {
    const span = this.#isLive() ? "newest first, live" : "of the time span";
    return complete ? span : `${span}; there are more, in the file as well`;
  }

  #has({ severity, source, text }) {
    const query = this.#query();
    const isBad = SEVERITIES.indexOf(severity) >= SEVERITIES.indexOf(query.severity);
    const isFrom = !query.source || query.source === source;
    return isBad && isFrom && text.toLowerCase().includes(query.text.toLowerCase());
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
    this.#body.replaceChildren(...this.#sorted().map(lineOf));
  }
}

function choice(label, options) {
  const made = options.map(([value, text]) => h("option", { value }, text));
  return h("select", { "aria-label": label }, made);
}

const timeInput = (label) =>
  h("input", { type: "datetime-local", step: 1, "aria-label": label, title: label });

/** The time in an input, UTC, in milliseconds since 1970; undefined where it has none. */
function timeOf({ value }) {
  const time = Date.parse(`${value}Z`);
  return Number.isNaN(time) ? undefined : time;
}

function addressOf(path, parameters) {
  const given = Object.entries(parameters).filter(([, value]) => value !== undefined);
  return `${path}?${new URLSearchParams(given)}`;
}

function lineOf({ received_ms, time_ms, source, severity, text }) {
  // The ground has no on-board time of its own.
  const onBoard = source === "satellite" ? inZone(time_ms) : "";
  const cells = [inZone(received_ms), onBoard, source, severity, text];
  return titledLine(TITLES, cells, { "data-severity": severity });
}
