// The form: tables with their fields; numbers with sliders; mistakes next to their fields.
// What an input is called is put together from texts that stand on the page, by their ids: the
// table, the key, the axis. What a key is about is read out with it, and shown below the form.

import { h } from "/dom.js";
import { t } from "./words.js";

const STEPS = 1000;

/** The id of an element of a table or key; names of the author's choice may have spaces. */
const idOf = (what, key) => `${what}-${key}`.replaceAll(/\s/g, "_");

export class Form {
  #box;
  #help = h("p", { class: "help", "aria-hidden": "true" });
  #change;
  #fields = new Map();
  #open = null;

  /** `change(key, value, isStructure)`: a value was set; `undefined`: taken out. */
  constructor(box, change) {
    this.#box = box;
    this.#change = change;
    box.addEventListener("focusin", ({ target }) => this.#explain(target));
  }

  #explain(input) {
    const about = input.closest(".field")?.querySelector(".about");
    this.#help.textContent = about?.textContent ?? "";
  }

  /** Builds the form again, with the same tables open and the focus where it was. */
  show(tables) {
    const before = this.#open;
    const isOpen = (table) =>
      before ? before.has(table.key) : table.fields.some((field) => field.given);
    this.#fields.clear();
    this.#open = new Set(tables.filter(isOpen).map((table) => table.key));
    const scrolled = this.#box.scrollTop;
    const focus = this.#focus();
    this.#box.replaceChildren(...tables.filter(isShown).map((table) => this.#table(table)), this.#help);
    this.#box.scrollTop = scrolled;
    focus.map((id) => document.getElementById(id)).find(Boolean)?.focus();
  }

  /** Ids of what has the focus and of the heading of its table, which stays. */
  #focus() {
    const element = document.activeElement;
    const table = this.#box.contains(element) && element.closest("[data-table]");
    return table ? [element.id, idOf("table", table.dataset.table)] : [];
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
    box.append(h("summary", { id: idOf("table", table.key) }, table.title));
    box.append(...this.#choices(table));
    const [given, rest] = [true, false].map((is) =>
      table.fields.filter((field) => (field.given || field.required) === is),
    );
    box.append(...given.map((field) => this.#field(table, field)));
    if (!rest.length) return box;
    const more = h("details", {}, h("summary", { "aria-label": t("more of {table}", { table: table.title }) }, t("more")));
    more.append(...rest.map((field) => this.#field(table, field)));
    box.append(given.length ? more : h("div", {}, ...rest.map((field) => this.#field(table, field))));
    return box;
  }

  #choices(table) {
    const found = [];
    if (!table.present) {
      const add = (value) => () => {
        this.#open.add(table.key);
        this.#change(table.key, value, true);
      };
      found.push(h("button", { onclick: add({}), "aria-label": t("add {table}", { table: table.title }) }, t("add")));
      for (const preset of table.presets) {
        const name = t("add {table}: {preset}", { table: table.title, preset });
        found.push(h("button", { onclick: add({ preset }), "aria-label": name }, preset));
      }
      return found;
    }
    if (table.kind) {
      const select = choiceOf(table.kind.choices, table.kind.value, (kind) =>
        this.#change(table.key, { kind }, true),
      );
      select.dataset.kind = table.key;
      const label = h("label", { id: idOf("label", `${table.key}.kind`) }, t("kind"));
      called(select, table, `${table.key}.kind`, "");
      label.htmlFor = select.id;
      found.push(h("div", { class: "field is-given" }, label, select));
    }
    if (table.optional && table.key !== "control.law") {
      const takeOut = () => this.#change(table.key, undefined, true);
      const name = t("take out {name}", { name: table.title });
      found.push(h("button", { onclick: takeOut, "aria-label": name }, t("take out")));
    }
    return found;
  }

  #field(table, field) {
    const set = (value) => {
      box.classList.add("is-given");
      this.#change(field.key, value, false);
    };
    const standard = field.default && t("default: {value}", { value: field.default });
    const otherwise = field.required ? t("must be given") : standard;
    const title = [field.about, field.values, otherwise].filter(Boolean).join("\n");
    const takeOut = { class: "clear", title: t("take out {name}", { name: field.name }), hidden: field.required };
    const clear = h("button", { ...takeOut, "aria-label": takeOut.title }, "×");
    clear.onclick = () => this.#change(field.key, undefined, true);
    const id = idOf("failure", field.key);
    const failure = h("p", { class: "failure", id, role: "alert", hidden: true });
    const about = h("p", { class: "about", id: idOf("about", field.key), hidden: true }, title);
    const box = h("div", { class: `field${field.given ? " is-given" : ""}`, title });
    box.dataset.key = field.key;
    const name = `${field.name}${field.unit ? ` [${field.unit}]` : ""}`;
    const label = h("label", { id: idOf("label", field.key) }, name);
    const head = h("div", { class: "head" }, label, field.given ? clear : null);
    const rows = inputsOf(field, set);
    const inputs = rows.flatMap((row, i) => namedIn(row, table, field, field.parts[i] ?? ""));
    label.htmlFor = inputs[0].id;
    box.append(head, ...rows, about, failure);
    const wrong = (text) => {
      failure.textContent = text;
      failure.hidden = !text;
      for (const input of inputs) input.setAttribute("aria-invalid", Boolean(text));
      box.classList.toggle("is-wrong", Boolean(text));
    };
    this.#fields.set(field.key, { wrong });
    return box;
  }
}

/** Gives an input its id and name: of its table, its key and, of several numbers, which one. */
function called(input, table, key, part) {
  input.id = [idOf(input.type, key), part].filter(Boolean).join("-");
  const names = [idOf("table", table.key), idOf("label", key), part && idOf("part", `${key}-${part}`)];
  input.setAttribute("aria-labelledby", names.filter(Boolean).join(" "));
}

/** The inputs of a row, with their names and with the texts that are read out after these. */
function namedIn(row, table, field, part) {
  if (part) row.prepend(h("span", { class: "part", id: idOf("part", `${field.key}-${part}`) }, part));
  const inputs = row.matches("select") ? [row] : [...row.querySelectorAll("input")];
  for (const input of inputs) {
    called(input, table, field.key, part);
    const texts = [idOf("failure", field.key), idOf("about", field.key)];
    input.setAttribute("aria-describedby", texts.join(" "));
  }
  return inputs;
}

const isShown = (table) =>
  table.fields.length > 0 || !table.present || (table.kind && table.kind.choices.length > 1);

function inputsOf(field, set) {
  if (field.type === "number") return [number(field.value, field, set, field.key)];
  if (field.type === "numbers") return numbersOf(field, set);
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

function numbersOf(field, set) {
  const values = [...(field.value ?? [0, 0, 0])];
  return values.map((value, i) =>
    number(value, field, (found) => set(Object.assign(values, { [i]: found }).slice()), `${field.key}[${i}]`),
  );
}

/** A number as a slider and text; text takes any value, the slider those that are usual. */
function number(value, { slider: span, unit }, set, key) {
  const text = h("input", { type: "text", inputMode: "decimal", value: value ?? "" });
  text.dataset.number = key;
  const row = h("div", { class: "row" });
  if (span) {
    const slider = h("input", { type: "range", min: 0, max: STEPS, step: 1 });
    slider.dataset.slider = key;
    const say = () => slider.setAttribute("aria-valuetext", `${text.value || t("none")} ${unit}`.trim());
    slider.value = value === null ? 0 : placeOf(value, span);
    say();
    slider.oninput = () => {
      const found = valueOf(Number(slider.value), span);
      text.value = found;
      say();
      set(found);
    };
    text.addEventListener("change", () => {
      slider.value = placeOf(Number(text.value), span);
      say();
    });
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
