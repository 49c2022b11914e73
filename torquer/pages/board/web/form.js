// The form: tables with their fields; numbers with sliders; mistakes next to their fields.

import { h } from "/dom.js";

const STEPS = 1000;

export class Form {
  #box;
  #change;
  #fields = new Map();
  #open = null;

  /** `change(key, value, isStructure)`: a value was set; `undefined`: taken out. */
  constructor(box, change) {
    this.#box = box;
    this.#change = change;
  }

  /** Builds the form again, with the same tables open. */
  show(tables) {
    const before = this.#open;
    const isOpen = (table) =>
      before ? before.has(table.key) : table.fields.some((field) => field.given);
    this.#fields.clear();
    this.#open = new Set(tables.filter(isOpen).map((table) => table.key));
    const scrolled = this.#box.scrollTop;
    this.#box.replaceChildren(...tables.filter(isShown).map((table) => this.#table(table)));
    this.#box.scrollTop = scrolled;
  }

  /** Shows mistakes next to their fields; those that are left have none. */
  mistakes(errors) {
    for (const field of this.#fields.values()) field.wrong("");
    return errors.filter((error) => {
      const key = this.#nearest(error.key);
      this.#fields.get(key)?.wrong(error.text);
      return !key;
    });
  }

  #nearest(key) {
    for (let one = key; one; one = one.replace(/(^|[.[])[^.[]*$/, ""))
      if (this.#fields.has(one)) return one;
    return "";
  }

  #table(table) {
    const box = h("details", { open: this.#open.has(table.key), title: table.about });
    box.dataset.table = table.key;
    box.addEventListener("toggle", () =>
      box.open ? this.#open.add(table.key) : this.#open.delete(table.key),
    );
    box.append(h("summary", {}, table.title));
    box.append(...this.#choices(table));
    const [given, rest] = [true, false].map((is) =>
      table.fields.filter((field) => (field.given || field.required) === is),
    );
    box.append(...given.map((field) => this.#field(field)));
    if (!rest.length) return box;
    const more = h("details", {}, h("summary", {}, "more"));
    more.append(...rest.map((field) => this.#field(field)));
    box.append(given.length ? more : h("div", {}, ...rest.map((field) => this.#field(field))));
    return box;
  }

  #choices(table) {
    const found = [];
    if (!table.present) {
      const add = (value) => () => {
        this.#open.add(table.key);
        this.#change(table.key, value, true);
      };
      found.push(h("button", { onclick: add({}) }, "add"));
      for (const preset of table.presets)
        found.push(h("button", { onclick: add({ preset }) }, preset));
      return found;
    }
    if (table.kind) {
      const select = choiceOf(table.kind.choices, table.kind.value, (kind) =>
        this.#change(table.key, { kind }, true),
      );
      select.dataset.kind = table.key;
      found.push(h("div", { class: "field is-given" }, h("label", {}, "kind"), select));
    }
    if (table.optional && table.key !== "control.law")
      found.push(
        h("button", { onclick: () => this.#change(table.key, undefined, true) }, "take out"),
      );
    return found;
  }

  #field(field) {
    const set = (value) => {
      box.classList.add("is-given");
      this.#change(field.key, value, false);
    };
    const title = [field.about, field.values, field.default && `default: ${field.default}`]
      .filter(Boolean)
      .join("\n");
    const clear = h("button", { class: "clear", title: "take out", hidden: field.required }, "×");
    clear.onclick = () => this.#change(field.key, undefined, true);
    const failure = h("p", { class: "failure", hidden: true });
    const box = h("div", { class: `field${field.given ? " is-given" : ""}`, title });
    box.dataset.key = field.key;
    const label = h("label", {}, `${field.name}${field.unit ? ` [${field.unit}]` : ""}`);
    if (field.given) label.append(clear);
    box.append(label, ...inputsOf(field, set), failure);
    const wrong = (text) => {
      failure.textContent = text;
      failure.hidden = !text;
      box.classList.toggle("is-wrong", Boolean(text));
    };
    this.#fields.set(field.key, { wrong });
    return box;
  }
}

const isShown = (table) =>
  table.fields.length > 0 || !table.present || (table.kind && table.kind.choices.length > 1);

function inputsOf(field, set) {
  if (field.type === "number") return [number(field.value, field.slider, set, field.key)];
  if (field.type === "numbers") return numbers(field, set);
  if (field.type === "choice") return [choiceOf(field.choices, field.value, set)];
  if (field.type === "flag") {
    const box = h("input", { type: "checkbox", checked: field.value === true });
    box.onchange = () => set(box.checked);
    return [h("div", { class: "row" }, box)];
  }
  const isData = field.type === "data";
  const shown = field.value === null ? "" : isData ? JSON.stringify(field.value) : field.value;
  const input = h("input", { type: "text", class: "is-wide", value: String(shown) });
  input.onchange = () => {
    if (field.type === "text") return set(input.value);
    try {
      set(JSON.parse(input.value));
    } catch {
      set(input.value);
    }
  };
  return [h("div", { class: "row" }, input)];
}

function numbers(field, set) {
  const values = [...(field.value ?? [0, 0, 0])];
  return values.map((value, i) =>
    number(value, field.slider, (found) => set(Object.assign(values, { [i]: found }).slice()), `${field.key}[${i}]`),
  );
}

/** A number as a slider and text; text takes any value, the slider those that are usual. */
function number(value, span, set, key) {
  const text = h("input", { type: "text", inputMode: "decimal", value: value ?? "" });
  text.dataset.number = key;
  const row = h("div", { class: "row" });
  if (span) {
    const slider = h("input", { type: "range", min: 0, max: STEPS, step: 1 });
    slider.dataset.slider = key;
    slider.value = value === null ? 0 : placeOf(value, span);
    slider.oninput = () => {
      const found = valueOf(Number(slider.value), span);
      text.value = found;
      set(found);
    };
    text.addEventListener("change", () => (slider.value = placeOf(Number(text.value), span)));
    row.append(slider);
  }
  text.addEventListener("change", () => {
    const found = Number(text.value);
    set(text.value.trim() === "" || Number.isNaN(found) ? text.value : found);
  });
  row.append(text);
  return row;
}

function placeOf(value, { low, high, log }) {
  const part = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.round(STEPS * part);
}

function valueOf(place, { low, high, log }) {
  const part = place / STEPS;
  const value = log ? low * (high / low) ** part : low + (high - low) * part;
  return Number(value.toPrecision(4));
}

function choiceOf(choices, value, set) {
  const options = choices.map((each) => h("option", { value: each, selected: each === value }, each));
  const select = h("select", {}, ...options);
  select.onchange = () => set(select.value);
  return select;
}
