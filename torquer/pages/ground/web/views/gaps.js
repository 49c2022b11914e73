// Gaps in the archive, and orders for what the satellite stored of them.

import { h } from "../dom.js";
import { get, inBackground, post, route } from "../net/api.js";
import { duration, inZone } from "../times.js";
import { operatorLine, orderButton } from "./operator.js";
import { titledLine } from "./titled.js";

const TITLES = ["Packet", "From (on board)", "To (on board)", "Missing", "Stored, received", "Record"];
/** The packet of which the satellite has a record, and the one in which it comes. */
const MAIN = "extended";
const STORED = "stored";
const REPLAY = "replay";
/** Rows of a record come many at once [ms]. */
const PAUSE_MS = 2000;

export function showGaps(element, context) {
  const gaps = new Gaps(context);
  element.append(gaps.element);
  return gaps.start();
}

class Gaps {
  #context;
  #waits = false;
  /** Orders by the gap that they are for, and the last news of commands by their numbers. */
  #orders = new Map();
  #states = new Map();
  #note = h("p", { class: "t-note", role: "status" });
  #failure = h("p", { class: "t-failure", role: "alert" });
  #body = h("tbody");

  constructor(context) {
    this.#context = context;
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    const again = { type: "button", class: "t-button", onclick: () => this.#ask() };
    this.element = h(
      "div",
      { class: "t-log t-folds" },
      h("div", {}, h("button", again, "Look again"), operatorLine(), this.#note, this.#failure),
      h(
        "div",
        { class: "t-scroll", tabindex: 0 },
        h("table", { class: "t-table" }, h("thead", {}, h("tr", {}, head)), this.#body),
      ),
    );
  }

  start() {
    const { live, rows, satellite, signal } = this.#context;
    live.on("commands", (commands) => this.#answered(commands), signal);
    rows.listen(satellite.key, STORED, () => this.#askSoon(), signal);
    return this.#show();
  }

  #askSoon() {
    if (this.#waits) return;
    this.#waits = true;
    setTimeout(() => {
      this.#waits = false;
      if (!this.#context.signal.aborted) this.#ask();
    }, PAUSE_MS);
  }

  #ask() {
    inBackground(this.#show(), this.#context.signal);
  }

  async #show() {
    const { satellite, signal } = this.#context;
    const { gaps, can_fill: canFill } = await get(route(satellite.key, "gaps"), {}, signal);
    this.#note.textContent =
      `${gaps.length} gaps within a week of telemetry, the latest first: rows farther apart than ` +
      "is usual, and what may be missing where the clock went back, as at a reboot. " +
      `${canFill ? "What the satellite stored comes as packets of its record." : ""}`;
    this.#body.replaceChildren(...gaps.reverse().map((gap) => this.#line(gap, canFill)));
  }

  #line(gap, canFill) {
    const { packet, start_ms, end_ms, every_ms, missing, stored, went_back } = gap;
    const most = went_back ? " at most: the clock went back" : "";
    const record = h("td", {});
    if (canFill && packet === MAIN) record.append(this.#button(gap));
    const texts = [
      ...[packet, inZone(start_ms), inZone(end_ms)],
      ...[`${missing}, one each ${duration(every_ms)}${most}`, String(stored)],
    ];
    return titledLine(TITLES, [...texts, record]);
  }

  #button({ start_ms, end_ms }) {
    const key = `${start_ms}-${end_ms}`;
    const state = h("span", { role: "status" });
    const order = this.#orders.get(key) ?? { id: null };
    order.element = state;
    this.#orders.set(key, order);
    const onclick = async () => {
      try {
        const path = route(this.#context.satellite.key, "gaps");
        const ordered = await post(path, { start: start_ms, end: end_ms });
        order.id = ordered.id;
        // News of the command may have come before the answer to the request.
        if (!this.#states.has(order.id)) this.#states.set(order.id, ordered);
        this.#failure.textContent = "";
      } catch (error) {
        this.#failure.textContent = error.message;
      }
      this.#showOrder(order);
    };
    const button = orderButton("Ask for it", onclick);
    this.#showOrder(order);
    return h("span", {}, button, state);
  }

  #answered(commands) {
    const { key } = this.#context.satellite;
    for (const one of commands)
      if (one.satellite === key && one.command === REPLAY) this.#states.set(one.id, one);
    for (const order of this.#orders.values()) this.#showOrder(order);
  }

  #showOrder({ id, element }) {
    const known = this.#states.get(id);
    if (!known) return;
    const reason = known.reason ? ` (${known.reason})` : "";
    element.textContent = ` no. ${id}: ${known.state}${reason}`;
  }
}
