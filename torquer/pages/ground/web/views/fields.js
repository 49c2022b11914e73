// Inputs of a command's fields; the server checks their values, and its words are shown.

import { h } from "../dom.js";

/** The input of a field: `name`, `element`, `value()`, and for choices `choose`, `onChange`. */
export function inputOf(field, regions) {
  const first = Object.values(regions)[0] ?? [];
  if (field.labels?.length) return new Choice(field, field.labels);
  // Names in place of numbers, which the description tells of.
  const named = { ...field, description: "" };
  if (field.name === "state" && first.length) return new Choice(named, first);
  if (field.choices?.length) return new Choice(named, field.choices);
  return field.type === "bytes" ? new Text(field) : new Numbers(field);
}

function labelled({ name, unit, description }, hint, ...inputs) {
  const title = h("span", { class: "t-field__name" }, name, unit ? ` [${unit}]` : "");
  const note = h("small", {}, [description, hint].filter(Boolean).join("; "));
  return h(
    "label",
    { class: "t-field" },
    title,
    h("span", { class: "t-field__inputs" }, inputs),
    note,
  );
}

class Choice {
  #select = h("select");

  constructor(field, choices) {
    this.name = field.name;
    this.#select.name = field.name;
    this.choose(choices);
    this.element = labelled(field, "", this.#select);
  }

  choose(choices) {
    this.#select.replaceChildren(
      ...choices.map((choice) => h("option", { value: choice }, choice)),
    );
  }

  onChange(listener) {
    this.#select.addEventListener("change", listener);
  }

  value() {
    return this.#select.value;
  }
}

class Text {
  #input;

  constructor(field) {
    this.name = field.name;
    const maxLength = field.count;
    this.#input = h("input", { type: "text", name: field.name, maxLength, spellcheck: false });
    this.element = labelled(field, `at most ${maxLength} ASCII characters`, this.#input);
  }

  value() {
    return this.#input.value;
  }
}

class Numbers {
  #inputs;

  constructor(field) {
    const { name, count, low, high } = field;
    this.name = name;
    const one = (_, i) =>
      h("input", {
        type: "number",
        step: "any",
        name: count > 1 ? `${name}.${i}` : name,
        "aria-label": count > 1 ? `${name}, number ${i + 1}` : name,
      });
    this.#inputs = Array.from({ length: Math.max(count, 1) }, one);
    this.element = labelled(field, rangeInWords(low, high), ...this.#inputs);
  }

  /** Empty inputs are null, to which the server answers what must be given. */
  value() {
    const values = this.#inputs.map(({ value }) => (value === "" ? null : Number(value)));
    return values.length > 1 ? values : values[0];
  }
}

function rangeInWords(low, high) {
  const isKnown = (x) => x !== null && x !== undefined && Math.abs(x) < 1e30;
  return isKnown(low) && isKnown(high) ? `${low} to ${high}` : "";
}
