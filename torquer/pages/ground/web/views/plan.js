// The time-tagged plan: what waits on board by the satellite's report, beside what is known here.

import { every, h, oncePerFrame } from "../dom.js";
import { get, inBackground, post, route } from "../net/api.js";
import { operatorLine, orderButton } from "./operator.js";
import { valuesInWords } from "./sent_list.js";
import { titledLine } from "./titled.js";
import { inZone } from "../times.js";

const EXECUTION = "Execution (on board)";
const TITLES = ["Plan", "Command", EXECUTION, "", "Values", "No.", "On the ground", "By"];
/** States in which a command of the ground can be cancelled. */
const WAITS = ["waiting", "received"];

export function showPlan(element, context) {
  const view = new PlanView(context);
  element.append(view.element);
  return view.start();
}

class PlanView {
  #context;
  #plan = { reported_ms: null, is_complete: false, entries: [] };
  #asked = 0;
  #shown = 0;
  #age = h("span", { class: "t-plan__age", role: "status" });
  #body = h("tbody");
  #error = h("p", { class: "t-failure", role: "alert" });

  constructor(context) {
    this.#context = context;
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    const ask = () => this.#order({ command: "plan_list", values: {} });
    const table = h("table", { class: "t-table" }, h("thead", {}, h("tr", {}, head)), this.#body);
    this.element = h(
      "div",
      { class: "t-plan t-folds t-scroll" },
      operatorLine(),
      h(
        "div",
        { class: "t-bar" },
        orderButton("Ask for the list", ask, { name: "ask" }),
        this.#age,
      ),
      this.#error,
      h("div", { class: "t-wide", tabIndex: 0, role: "region", "aria-label": "Plan" }, table),
    );
    this.ask = oncePerFrame(() => inBackground(this.#ask(), context.signal), context.signal);
  }

  async start() {
    const { live, rows, satellite, signal } = this.#context;
    const isOurs = (one) => one.satellite === satellite.key;
    live.on("commands", (all) => all.some(isOurs) && this.ask(), signal);
    live.on("again", () => this.ask(), signal);
    rows.listen(satellite.key, "plan", () => this.ask(), signal);
    every(1000, () => this.#showAge(), signal);
    await this.#ask();
  }

  async #ask() {
    const { satellite, signal } = this.#context;
    const asked = ++this.#asked;
    const plan = await get(route(satellite.key, "plan"), {}, signal);
    if (asked < this.#shown) return; // what was asked for later has come before
    this.#shown = asked;
    this.#plan = plan;
    this.#showAge();
    const lines = this.#plan.entries.map((entry) => this.#lineOf(entry));
    const none = h("td", { colSpan: TITLES.length, class: "t-note" }, "no delayed command");
    this.#body.replaceChildren(...(lines.length ? lines : [h("tr", {}, none)]));
  }

  #showAge() {
    const { reported_ms, is_complete } = this.#plan;
    const part = is_complete ? "" : ", not all of it has come";
    this.#age.textContent = reported_ms
      ? `The satellite's list is ${ageInWords(Date.now() - reported_ms)} old${part}.`
      : "The satellite has not listed its plan yet.";
  }

  #lineOf(entry) {
    const { id, request, command, values, execute_ms, state, made_by, mark } = entry;
    const number = id === null ? `request ${request}` : String(id);
    const rest = [valuesInWords(values), number, state ?? "not known", made_by ?? ""];
    const cells = [
      h("td", { class: "t-plan__mark" }, mark),
      command ?? "not in the dictionary",
      h("td", { class: "t-plan__time" }, inZone(execute_ms)),
      this.#cancelOf(entry) ?? "",
      ...rest,
    ];
    return titledLine(TITLES, cells, { "data-mark": mark });
  }

  /** By the number here where the command waits, else by that on board. */
  #cancelOf({ id, request, command, state, mark }) {
    const onBoard = { command: "plan_cancel", values: { request } };
    const label = { "aria-label": `Cancel ${command} ${id ?? `request ${request}`}` };
    if (WAITS.includes(state)) return orderButton("Cancel", () => this.#cancel(id), label);
    const isThere = mark === "on board only" || mark === "as sent";
    return isThere && request ? orderButton("Cancel", () => this.#order(onBoard), label) : null;
  }

  #cancel(id) {
    return this.#try(route(this.#context.satellite.key, "commands", String(id), "cancel"), {});
  }

  #order(body) {
    return this.#try(route(this.#context.satellite.key, "commands"), body);
  }

  async #try(path, body) {
    this.#error.textContent = "";
    try {
      await post(path, body);
    } catch (error) {
      this.#error.textContent = error.message;
    }
    this.ask();
  }
}

function ageInWords(milliseconds) {
  const seconds = Math.max(0, Math.round(milliseconds / 1000));
  if (seconds < 120) return `${seconds} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}
