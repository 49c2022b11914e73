// What was known at an instant of the past, with the age of each packet.

import { h } from "../dom.js";
import { inBackground } from "../net/api.js";
import { knownAt, PastRows } from "../net/past_rows.js";
import { QUALITIES } from "../net/rows.js";
import { duration, inZone } from "../times.js";
import { showModes } from "./modes.js";
import { showState } from "./state.js";
import { valueInWords } from "./values.js";

const MINUTE_MS = 60_000;
const STEPS = [
  ["− 10 min", -10 * MINUTE_MS],
  ["− 1 min", -MINUTE_MS],
  ["+ 1 min", MINUTE_MS],
  ["+ 10 min", 10 * MINUTE_MS],
];

const showAttitude = async (element, context) =>
  (await import("../attitude/view.js")).showAttitude(element, context);

/** What can be shown of an instant, with the words for it. */
const SHOWN = {
  values: ["all values", (element, context) => element.append(valuesOf(context))],
  state: ["state", showState],
  modes: ["mode diagram", showModes],
  attitude: ["attitude 3D", showAttitude],
};

export function showPast(element, context) {
  const past = new Past(context);
  element.append(past.element);
  return past.start();
}

class Past {
  #context;
  #asked = 0;
  #shown = new AbortController();
  #at = h("input", { type: "datetime-local", step: 1 });
  #by = h(
    "select",
    { "aria-label": "Which time" },
    h("option", { value: "time" }, "on-board time: what the satellite had measured"),
    h("option", { value: "received" }, "reception: what the ground knew"),
  );
  #what = h("select", { "aria-label": "What is shown" });
  #note = h("p", { class: "t-note", role: "status" });
  #failure = h("p", { class: "t-failure", role: "alert" });
  #box = h("div", { class: "t-past__box t-scroll", tabindex: 0 });

  constructor(context) {
    this.#context = context;
    const { has, packets } = context.satellite;
    const can = { modes: has.modes, attitude: packets.has("extended") };
    for (const [key, [text]] of Object.entries(SHOWN))
      if (can[key] ?? true) this.#what.append(h("option", { value: key }, text));
    for (const one of [this.#at, this.#by, this.#what]) one.onchange = () => this.#ask();
    const steps = STEPS.map(([text, step]) =>
      h("button", { type: "button", class: "t-button", onclick: () => this.#move(step) }, text),
    );
    const newest = { type: "button", class: "t-button", onclick: () => this.#toNewest() };
    this.element = h(
      "div",
      { class: "t-past" },
      h(
        "div",
        { class: "t-bar t-bar--wraps" },
        h("label", {}, "At (UTC) ", this.#at),
        steps,
        h("button", newest, "Newest"),
        this.#by,
        this.#what,
      ),
      h("div", {}, this.#note, this.#failure),
      this.#box,
    );
    context.signal.addEventListener("abort", () => this.#shown.abort());
  }

  start() {
    const { openmct } = this.#context;
    this.#by.value = openmct.time.getTimeSystem().key === "received" ? "received" : "time";
    this.#set(Math.floor(openmct.time.getBounds().end));
    return this.#show();
  }

  #set(time) {
    this.#at.value = new Date(time).toISOString().slice(0, 19);
  }

  #move(step) {
    const time = Date.parse(`${this.#at.value}Z`);
    if (Number.isNaN(time)) return;
    this.#set(time + step);
    this.#ask();
  }

  #toNewest() {
    const { openmct, satellite } = this.#context;
    const clock = openmct.time.getAllClocks().find(({ key }) => key === `onboard.${satellite.key}`);
    this.#set(this.#by.value === "received" ? Date.now() : clock.currentValue());
    this.#ask();
  }

  #ask() {
    inBackground(this.#show(), this.#context.signal);
  }

  async #show() {
    const { satellite, signal } = this.#context;
    const time = Date.parse(`${this.#at.value}Z`);
    const asked = ++this.#asked;
    try {
      if (Number.isNaN(time)) throw new Error("At: must be a date and a time");
      const known = await knownAt(satellite, time, this.#by.value, signal);
      // Steps may be asked for faster than they are answered.
      if (asked === this.#asked) await this.#fill(known);
    } catch (error) {
      if (!signal.aborted) this.#failure.textContent = error.message;
    }
  }

  async #fill(known) {
    this.#failure.textContent = "";
    const stale = known.packets.filter((one) => one.stale).length;
    const clock = known.by === "received" ? "received by then" : "on board by then";
    this.#note.textContent =
      `${inZone(known.time)}: ${known.packets.length} packets ${clock}, ${stale} of them stale. ` +
      "This is the past, not what comes now.";
    this.#shown.abort();
    this.#shown = new AbortController();
    this.#box.replaceChildren();
    const rows = new PastRows(this.#context.satellite, known);
    const context = { ...this.#context, rows, known, signal: this.#shown.signal };
    await SHOWN[this.#what.value][1](this.#box, context);
  }
}

/** State in words, then each packet with its age and its values. */
function valuesOf({ satellite, known }) {
  const state = Object.entries(known.state).map(([name, text]) =>
    h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, text)),
  );
  return h(
    "div",
    {},
    h("h2", { class: "t-heading" }, "Modes, flags, attitude"),
    state.length ? h("table", { class: "t-table t-values" }, h("tbody", {}, state)) : "none known",
    known.packets.map((one) => packetOf(satellite.packets.get(one.packet), one)),
  );
}

function packetOf(packet, one) {
  const came = one.received_ms === null ? "from a recording" : `received ${inZone(one.received_ms)}`;
  const age = `${duration(one.age_ms)} old${one.stale ? ": stale" : ""}`;
  const about = `${inZone(one.time_ms)} on board, ${came}, ${QUALITIES[one.quality]}, `;
  const cells = packet.numbers.map((number) =>
    h(
      "tr",
      { title: number.description },
      h("th", { scope: "row" }, number.name),
      h("td", { class: "t-values__value" }, valueInWords(number, one.values[number.key])),
      h("td", { class: "t-values__unit" }, number.unit),
    ),
  );
  return h(
    "section",
    { class: one.stale ? "is-stale" : "", "data-packet": packet.key },
    h("h2", { class: "t-heading" }, packet.name),
    h("p", { class: "t-values__head" }, about, h("b", { class: "t-age" }, age)),
    h("table", { class: "t-table t-values" }, h("tbody", {}, cells)),
  );
}
