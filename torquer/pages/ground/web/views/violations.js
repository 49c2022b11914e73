// The out-of-limits log: from when to when, how far, in which mode, who acknowledged it.

import { h, number } from "../dom.js";
import { get, inBackground, route } from "../net/api.js";
import { SEVERITY_SIGNS } from "../limits.js";
import { inZone } from "../times.js";
import { titledLine } from "./titled.js";

/** Most violations shown of a satellite, and time between two looks at them [ms]. */
const MOST = 200;
const PAUSE_MS = 2000;
const TITLES = [
  ...["Severity", "Satellite", "What", "From (on board)", "To", "Extreme", "Limit", "Times"],
  "Acknowledged",
];

export class ViolationLog {
  #context;
  #keys;
  #body = h("tbody");
  #due = null;
  #stamps = new Map();

  /** `wanted`: key of a satellite, or null for all. */
  constructor(context, wanted) {
    this.#context = context;
    this.#keys = wanted === null ? [...context.satellites.keys()] : [wanted];
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    this.element = h(
      "section",
      { "aria-label": "Out-of-limits log" },
      h("h2", { class: "t-heading" }, `Out-of-limits log: the last ${MOST}`),
      h("table", { class: "t-table t-violations" }, h("thead", {}, h("tr", {}, head)), this.#body),
    );
  }

  start() {
    const { alarms, signal } = this.#context;
    alarms.listen((changed) => this.#isNews(changed) && this.#later(), signal);
    signal.addEventListener("abort", () => clearTimeout(this.#due));
    return this.#ask();
  }

  /** Whether more than values has changed. */
  #isNews(changed) {
    const stamps = changed.map(({ satellite, key, number, state, count, acknowledged_ms }) => [
      `${satellite}/${key}`,
      `${number} ${state} ${count} ${acknowledged_ms}`,
    ]);
    const news = stamps.filter(([id, stamp]) => this.#stamps.get(id) !== stamp);
    for (const [id, stamp] of news) this.#stamps.set(id, stamp);
    return news.length > 0;
  }

  #later() {
    this.#due ??= setTimeout(() => {
      this.#due = null;
      inBackground(this.#ask(), this.#context.signal);
    }, PAUSE_MS);
  }

  async #ask() {
    const { signal } = this.#context;
    const asked = this.#keys.map(async (satellite) => {
      const found = await get(route(satellite, "violations"), { size: MOST }, signal);
      return found.map((one) => ({ satellite, ...one }));
    });
    const all = (await Promise.all(asked)).flat().sort((a, b) => b.received_ms - a.received_ms);
    this.#body.replaceChildren(...all.slice(0, MOST).map((one) => this.#line(one)));
  }

  #line(one) {
    const { name } = this.#context.satellites.get(one.satellite);
    const texts = [
      `${SEVERITY_SIGNS[one.severity]} ${one.severity}`,
      name,
      one.key,
      inZone(one.start_ms),
      one.is_over ? inZone(one.end_ms) : "lasts",
      number(Number(one.extreme)),
      one.mode ? `${one.limit} (${one.mode})` : one.limit,
      String(one.count),
      acknowledgedInWords(one),
    ];
    return titledLine(TITLES, texts, { "data-severity": one.severity });
  }
}

const acknowledgedInWords = ({ acknowledged_by: by, acknowledged_ms: at, comment }) =>
  at === null ? "" : `${by} ${inZone(at)}${comment ? `: ${comment}` : ""}`;
