// Gaps in the archive, and orders for what the satellite stored of them.

import { h } from "../dom.js";
import { get, inBackground, post, route } from "../net/api.js";
import { duration, inZone } from "../times.js";

const TITLES = ["Packet", "From (on board)", "To (on board)", "Missing", "Stored, received", "Record"];
/** The packet of which the satellite has a record, and the one in which it comes. */
const MAIN = "extended";
const STORED = "stored";
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
  #orders = new Map();
  #note = h("p", { class: "t-note", role: "status" });
  #failure = h("p", { class: "t-failure", role: "alert" });
  #body = h("tbody");

  constructor(context) {
    this.#context = context;
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    const again = { type: "button", class: "t-button", onclick: () => this.#ask() };
    this.element = h(
      "div",
      { class: "t-log" },
      h("div", {}, h("button", again, "Look again"), this.#note, this.#failure),
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
      `is usual. ${canFill ? "What the satellite stored comes as packets of its record." : ""}`;
    this.#body.replaceChildren(...gaps.reverse().map((gap) => this.#line(gap, canFill)));
  }

  #line(gap, canFill) {
    const { packet, start_ms, end_ms, every_ms, missing, stored } = gap;
    const record = h("td", {});
    if (canFill && packet === MAIN) record.append(this.#button(gap));
    const texts = [
      ...[packet, inZone(start_ms), inZone(end_ms)],
      ...[`${missing}, one each ${duration(every_ms)}`, String(stored)],
    ];
    return h("tr", {}, texts.map((text) => h("td", {}, text)), record); // prettier-ignore
  }

  #button({ start_ms, end_ms }) {
    const key = `${start_ms}-${end_ms}`;
    const known = this.#orders.get(key);
    const state = h("span", { role: "status" }, known?.state ?? "");
    if (known) known.element = state;
    const onclick = async () => {
      try {
        const { id, state: text } = await post(route(this.#context.satellite.key, "gaps"), {
          start: start_ms,
          end: end_ms,
        });
        state.textContent = ` no. ${id}: ${text}`;
        this.#orders.set(key, { id, state: state.textContent, element: state });
        this.#failure.textContent = "";
      } catch (error) {
        this.#failure.textContent = error.message;
      }
    };
    return h("span", {}, h("button", { type: "button", class: "t-button", onclick }, "Ask for it"), state); // prettier-ignore
  }

  #answered(commands) {
    for (const { satellite, id, state, reason } of commands)
      for (const order of this.#orders.values())
        if (satellite === this.#context.satellite.key && order.id === id) {
          order.state = ` no. ${id}: ${state}${reason ? ` (${reason})` : ""}`;
          order.element.textContent = order.state;
        }
  }
}
