// A table of the newest values of a packet.

import { bitsInWords } from "../bits.js";
import { h, number, oncePerFrame } from "../dom.js";
import { QUALITIES } from "../net/rows.js";
import { judge, limitsInWords, SEVERITY_SIGNS } from "../limits.js";
import { inZone } from "../times.js";

/** Text of a value: its label, the names of its bits, or its number. */
export function valueInWords(one, value) {
  if (value === null || value === undefined) return "unknown";
  if (one.bits) return bitsInWords(one.bits, value);
  return one.labels?.get(value) ?? (one.format === "string" ? value : number(value));
}

/**
 * Shows `numbers` of a packet, live. `columns`: whether there is room for descriptions. Rows have
 * the address of the number's plot.
 */
export function showValues(element, { satellite, rows, signal }, packet, numbers, isWide) {
  const cells = numbers.map((one) => new ValueRow(one, isWide));
  const head = h("p", { class: "t-values__head" }, "no frame yet");
  const table = h(
    "table",
    { class: "t-table t-values" },
    h(
      "tbody",
      {},
      cells.map(({ element }) => element),
    ),
  );
  element.append(head, table);

  let newest = null;
  const draw = oncePerFrame(() => {
    head.textContent = frameInWords(packet, newest);
    head.classList.toggle("is-suspect", newest.quality === 0);
    const valueOf = (one) => newest.values[packet.places.get(one.key)];
    cells.forEach((cell, i) => cell.show(valueOf(numbers[i]), satellite.modes));
  }, signal);
  const take = (row) => {
    newest = row;
    draw();
  };
  return rows.follow(satellite.key, packet.key, take, signal);
}

function frameInWords(packet, { time, received, quality }) {
  const when = received === null ? "from a recording" : `received ${inZone(received)}`;
  return `${packet.name}: ${inZone(time)} on board, ${when}, ${QUALITIES[quality]}`;
}

class ValueRow {
  #one;
  #text = h("span");
  #beyond = h("span", { class: "t-values__beyond" });
  #value = h("td", { class: "t-values__value" }, this.#text, this.#beyond);

  constructor(one, isWide) {
    this.#one = one;
    const limits = limitsInWords(one);
    this.element = h(
      "tr",
      { title: one.description },
      h("th", { scope: "row" }, one.name),
      this.#value,
      h("td", { class: "t-values__unit" }, one.unit),
      isWide ? h("td", {}, limits) : null,
      isWide ? h("td", { class: "t-values__description" }, one.description) : null,
    );
  }

  show(value, modes) {
    const text = valueInWords(this.#one, value);
    const beyond = judge(this.#one, value, modes);
    const sign = beyond && SEVERITY_SIGNS[beyond.severity];
    const note = beyond ? `${sign} ${beyond.severity}: ${beyond.words}` : "";
    if (this.#text.textContent !== text) this.#text.textContent = text;
    if (this.#beyond.textContent !== note) this.#beyond.textContent = note;
    this.#value.classList.toggle("is-unknown", value === null || value === undefined);
    this.#value.classList.toggle("is-beyond", beyond !== null);
    this.#value.classList.toggle("is-alarm", beyond?.severity === "alarm");
  }
}
