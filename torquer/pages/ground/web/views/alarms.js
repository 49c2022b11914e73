// The list of alarms: what calls for somebody first; acknowledged, shelved, and the log of all.

import { h, oncePerFrame } from "../dom.js";
import { SEVERITY_SIGNS } from "../limits.js";
import { ShelveDialog } from "./shelve_dialog.js";
import { valueInWords } from "./values.js";
import { ViolationLog } from "./violations.js";
import { inZone, inZoneToday } from "../times.js";
import { operatorLine, orderButton } from "./operator.js";

const TITLES = ["Severity", "Satellite", "What", "Since (on board)", "Value", "Limit", "Count"];
const RANKS = { warning: 1, alarm: 2 };
const WORDS = {
  active: "not acknowledged",
  acknowledged: "acknowledged",
  returned: "in order again, not acknowledged",
  latched: "in order again, to be cleared",
  settling: "in order again",
};

export function showAlarms(element, context) {
  const list = new AlarmList(context);
  const log = new ViolationLog(context, list.wanted);
  element.append(h("div", { class: "t-alarms t-folds t-scroll" }, list.element, log.element));
  list.draw();
  return log.start();
}

class AlarmList {
  #context;
  #lines = new Map();
  #body = h("tbody");
  #none = h("p", { class: "t-note", role: "status" });
  #failure = h("p", { class: "t-failure", role: "alert" });
  #comment = h("input", {
    type: "text",
    maxLength: 500,
    placeholder: "comment (optional)",
    "aria-label": "Comment with which alarms are acknowledged",
  });
  #all = orderButton("Acknowledge all", () => this.#acknowledge(this.#calling()));
  #dialog;

  constructor(context) {
    this.#context = context;
    this.wanted = context.satellite?.key ?? null;
    this.#dialog = new ShelveDialog((alarm, seconds, reason) =>
      this.#act(() => context.alarms.shelve(alarm, seconds, reason)),
    );
    const head = [...TITLES, "State", "Act"].map((title) => h("th", { scope: "col" }, title));
    this.element = h(
      "section",
      { "aria-label": "Alarms" },
      h("div", { class: "t-bar" }, operatorLine(), this.#comment, this.#all),
      this.#failure,
      this.#none,
      h("table", { class: "t-table t-alarms__list" }, h("thead", {}, h("tr", {}, head)), this.#body),
      this.#dialog.element,
    );
    const redraw = oncePerFrame(() => this.draw(), context.signal);
    context.alarms.listen(redraw, context.signal);
  }

  draw() {
    const sorted = this.#listed().sort(byUrgency);
    const wanted = new Map(sorted.map((alarm) => [idOf(alarm), alarm]));
    for (const [id, line] of this.#lines) if (!wanted.has(id)) this.#remove(id, line);
    for (const [id, alarm] of wanted) {
      if (!this.#lines.has(id)) this.#lines.set(id, this.#line());
      this.#lines.get(id).show(alarm);
    }
    this.#order([...wanted.keys()].map((id) => this.#lines.get(id).element));
    const { isKnown } = this.#context.alarms;
    const words = sorted.length ? "" : "No alarms: all that has limits is in order.";
    this.#none.textContent = isKnown ? words : "No word from the server: alarms are unknown.";
    this.#body.parentElement.hidden = !sorted.length;
    this.#all.disabled = !this.#calling().length;
  }

  /** Lines are moved only where their order has changed, and keep the focus. */
  #order(elements) {
    const isSame = elements.every((element, i) => this.#body.children[i] === element);
    if (isSame) return;
    const focused = document.activeElement;
    this.#body.append(...elements);
    if (this.#body.contains(focused)) focused.focus();
  }

  #remove(id, { element }) {
    if (element.contains(document.activeElement)) this.#comment.focus();
    element.remove();
    this.#lines.delete(id);
  }

  #listed() {
    return this.#context.alarms.list(this.wanted);
  }

  #calling() {
    return this.#listed().filter(calls);
  }

  #line() {
    const { satellites } = this.#context;
    return new AlarmLine(satellites, {
      acknowledge: (alarm) => this.#acknowledge([alarm]),
      shelve: (alarm) => this.#dialog.open(alarm),
      unshelve: (alarm) => this.#act(() => this.#context.alarms.unshelve(alarm)),
    });
  }

  #acknowledge(alarms) {
    const comment = this.#comment.value.trim();
    this.#comment.value = "";
    return this.#act(() => this.#context.alarms.acknowledge(alarms, comment));
  }

  async #act(request) {
    this.#failure.textContent = "";
    try {
      await request();
    } catch (error) {
      this.#failure.textContent = error.message;
    }
  }
}

/** A line of the list: made once, so that what is focused stays so. */
class AlarmLine {
  #satellites;
  #cells = [...TITLES, "State"].map((title) => h("td", { "data-title": title }));
  #acknowledge = orderButton("", () => this.acts.acknowledge(this.alarm));
  #shelve = orderButton("", () => this.#shelveOrNot());

  constructor(satellites, acts) {
    this.#satellites = satellites;
    this.acts = acts;
    const act = h("td", { "data-title": "Act" }, this.#acknowledge, " ", this.#shelve);
    this.element = h("tr", {}, this.#cells, act);
  }

  #shelveOrNot() {
    (this.alarm.shelf ? this.acts.unshelve : this.acts.shelve)(this.alarm);
  }

  show(alarm) {
    this.alarm = alarm;
    const { key, state, shelf, severity } = alarm;
    this.element.dataset.key = key;
    this.element.dataset.alarm = state ?? "none";
    this.element.dataset.severity = shelf || !state ? "none" : severity;
    this.element.classList.toggle("is-calling", calls(alarm));
    this.element.title = alarm.description;
    textsOf(alarm, this.#satellites).forEach((text, i) => {
      if (this.#cells[i].textContent !== text) this.#cells[i].textContent = text;
    });
    const isClear = state === "latched";
    const canAcknowledge = ["active", "returned", "latched"].includes(state);
    button(this.#acknowledge, isClear ? "Clear" : "Acknowledge", key, canAcknowledge);
    button(this.#shelve, shelf ? "Unshelve" : "Shelve", key, true);
  }
}

function button(element, text, key, isThere) {
  // One that goes away must not take the focus with it.
  if (!isThere && document.activeElement === element) element.nextElementSibling.focus();
  element.hidden = !isThere;
  if (element.textContent !== text) element.textContent = text;
  element.setAttribute("aria-label", `${text} ${key}`);
}

function textsOf(alarm, satellites) {
  const { satellite, key, severity, state, since_ms: since, limit, mode, count } = alarm;
  const { name } = satellites.get(satellite);
  if (!state) return ["", name, key, "", "", "", "", shelfInWords(alarm)];
  return [
    `${SEVERITY_SIGNS[severity]} ${severity}`,
    name,
    key,
    inZone(since),
    valueOf(alarm, satellites),
    mode ? `${limit} (${mode})` : limit,
    String(count),
    stateInWords(alarm),
  ];
}

function valueOf({ satellite, key, value, unit }, satellites) {
  const [packet, number] = key.split(".");
  const found = satellites.get(satellite).packets.get(packet);
  const one = found?.numbers[found.places.get(number)];
  if (!one) return "";
  const text = valueInWords(one, value);
  return value !== null && unit ? `${text} ${unit}` : text;
}

function stateInWords(alarm) {
  const { state, condition, acknowledged_by: by, acknowledged_ms: at, comment } = alarm;
  const isUnknown = condition === "unknown" ? "; value unknown" : "";
  const who = at === null ? "" : ` by ${by} ${inZoneToday(at)}${comment ? `: ${comment}` : ""}`;
  return `${WORDS[state]}${who}${isUnknown}${alarm.shelf ? `; ${shelfInWords(alarm)}` : ""}`;
}

const shelfInWords = ({ shelf: { until_ms: until, by, reason } }) =>
  `shelved until ${inZoneToday(until)} by ${by}: ${reason}`;

const idOf = ({ satellite, key }) => `${satellite}/${key}`;
const calls = ({ state, shelf, acknowledged_ms: at }) => Boolean(state) && !shelf && at === null;

/** What calls first, then by severity, the newest first. */
function byUrgency(a, b) {
  const rank = (one) => [calls(one) ? 1 : 0, one.shelf ? 0 : 1, RANKS[one.severity] ?? 0];
  const [first, second] = [rank(a), rank(b)];
  for (const [i, each] of first.entries()) if (each !== second[i]) return second[i] - each;
  return (b.raised_ms ?? 0) - (a.raised_ms ?? 0) || a.key.localeCompare(b.key);
}
