// The command stack: loaded from a file, the editor or what is saved, then stepped or run.

import { every, h, oncePerFrame } from "../dom.js";
import { get, inBackground, post, route } from "../net/api.js";
import { mayCommand } from "../net/role.js";
import { operatorLine, orderButton } from "./operator.js";
import { valuesInWords } from "./sent_list.js";
import { inZone } from "../times.js";

const EXAMPLE = `[[commands]]
comment = "is everybody there?"
command = "report_status"
values = { module_id = 1 }
pause_s = 2
`;
/** Buttons with what they do, and the state in which they can be used. */
const ACTIONS = [
  ["next", "Send next", "held"],
  ["run", "Run", "held"],
  ["hold", "Hold", "running"],
  ["skip", "Skip next", "held"],
  ["abort", "Abort", "held running"],
];
const TITLES = ["No.", "Step", "State", "Command", "Waits for"];

export function showStack(element, context) {
  const view = new StackView(context);
  element.append(view.element);
  return view.start();
}

class StackView {
  #context;
  #stack = null;
  #asked = 0;
  #shown = 0;
  #head = h("p", { class: "t-stack__head", role: "status" });
  #buttons = new Map();
  #body = h("tbody");
  #error = h("p", { class: "t-failure", role: "alert" });
  #loader;

  constructor(context) {
    this.#context = context;
    const key = context.satellite.key;
    this.#loader = new Loader(key, () => this.#ask(), (error) => this.#fail(error));
    for (const [action, text] of ACTIONS)
      this.#buttons.set(action, orderButton(text, () => this.#act(action), { name: action }));
    const head = TITLES.map((title) => h("th", { scope: "col" }, title));
    const steps = h("table", { class: "t-table" }, h("thead", {}, h("tr", {}, head)), this.#body);
    this.element = h(
      "div",
      { class: "t-stack t-scroll" },
      operatorLine(),
      this.#head,
      h("div", { class: "t-bar", role: "group", "aria-label": "Stack" }, [
        ...this.#buttons.values(),
      ]),
      this.#error,
      h("div", { class: "t-wide", tabIndex: 0, role: "region", "aria-label": "Steps" }, steps),
      this.#loader.element,
    );
    this.ask = oncePerFrame(() => inBackground(this.#ask(), context.signal), context.signal);
  }

  async start() {
    const { live, satellite, signal } = this.#context;
    const ofSatellite = (one) => one.satellite === satellite.key;
    const onNews = (all) => all.some(ofSatellite) && this.ask();
    live.on("stack", onNews, signal);
    // What becomes of a command that is on its way is news of the stack, too.
    live.on("commands", onNews, signal);
    live.on("again", () => this.ask(), signal);
    every(1000, () => this.#stack?.pause_s > 0 && this.ask(), signal);
    await this.#ask();
  }

  async #ask() {
    const { satellite, signal } = this.#context;
    const asked = ++this.#asked;
    const { stack, saved } = await get(route(satellite.key, "stack"), {}, signal);
    if (asked < this.#shown) return; // what was asked for later has come before
    this.#shown = asked;
    this.#stack = stack;
    this.#loader.list(saved);
    this.#draw();
  }

  async #act(action) {
    this.#error.textContent = "";
    const { id, next } = this.#stack;
    try {
      const path = route(this.#context.satellite.key, "stack", action);
      await post(path, { stack: id, place: next });
    } catch (error) {
      this.#fail(error);
    }
    await this.#ask();
  }

  #fail(error) {
    this.#error.textContent = error?.message ?? "";
  }

  #draw() {
    const stack = this.#stack;
    this.#head.textContent = stack ? stackInWords(stack) : "No stack was loaded.";
    this.#head.dataset.state = stack?.state ?? "none";
    for (const [action, , states] of ACTIONS) {
      const isPossible = stack && states.split(" ").includes(stack.state);
      const needsStep = action === "next" || action === "skip" || action === "run";
      const button = this.#buttons.get(action);
      button.disabled = !mayCommand() || !isPossible || (needsStep && !stack.next);
    }
    this.#body.replaceChildren(...(stack?.steps ?? []).map((step) => lineOf(step, stack.next)));
  }
}

/** Where a stack comes from. */
class Loader {
  #satellite;
  #changed;
  #failed;
  #text = h("textarea", { rows: 9, spellcheck: false, placeholder: EXAMPLE, name: "text" });
  #name = h("input", { type: "text", name: "name", maxLength: 60, spellcheck: false });
  #file = h("input", { type: "file", accept: ".toml", onchange: () => this.#read() });
  #saved = h("ul", { class: "t-stack__saved" });

  constructor(satellite, changed, failed) {
    this.#satellite = satellite;
    this.#changed = changed;
    this.#failed = failed;
    this.element = h(
      "details",
      { class: "t-stack__loader", open: true },
      h("summary", {}, "Load a stack"),
      h(
        "div",
        { class: "t-bar" },
        h("label", {}, "File ", this.#file),
        h("label", {}, "Name ", this.#name),
      ),
      h("label", { class: "t-stack__text" }, "Steps, as TOML", this.#text),
      h(
        "div",
        { class: "t-bar" },
        orderButton("Check and load", () => this.#load(), { name: "load", class: "t-send" }),
        orderButton("Save on the ground", () => this.#save(), { name: "save" }),
      ),
      h("h3", { class: "t-heading" }, "Saved on the ground"),
      this.#saved,
    );
  }

  list(names) {
    const none = h("li", { class: "t-note" }, "none");
    this.#saved.replaceChildren(...(names.length ? names.map((name) => this.#line(name)) : [none]));
  }

  #line(name) {
    const open = () =>
      this.#try(async () => {
        this.#text.value = (await get(this.#path(name))).text;
        this.#name.value = name;
      });
    const load = () => this.#try(() => post(route(this.#satellite, "stack"), { name }));
    const remove = () =>
      confirm(`Delete the stack ${name}?`) &&
      this.#try(() => post(this.#path(name), {}, "DELETE"));
    const labelled = (what) => ({ "aria-label": `${what} ${name}` });
    return h(
      "li",
      { class: "t-bar" },
      h("span", { class: "t-stack__name" }, name),
      h(
        "button",
        { type: "button", class: "t-button", onclick: open, ...labelled("Show") },
        "Show",
      ),
      orderButton("Load", load, labelled("Load")),
      orderButton("Delete", remove, labelled("Delete")),
    );
  }

  #path(name) {
    return route(this.#satellite, "stacks", name);
  }

  async #read() {
    const [file] = this.#file.files;
    if (!file) return;
    this.#text.value = await file.text();
    this.#name.value = nameOf(file.name);
  }

  #load() {
    const body = { name: this.#name.value.trim(), text: this.#text.value };
    return this.#try(() => post(route(this.#satellite, "stack"), body));
  }

  #save() {
    const name = this.#name.value.trim();
    if (!name) return this.#failed(new Error("name: must be given to save; received nothing"));
    return this.#try(() => post(this.#path(name), { text: this.#text.value }, "PUT"));
  }

  async #try(work) {
    this.#failed(null);
    try {
      await work();
      await this.#changed();
    } catch (error) {
      this.#failed(error);
    }
  }
}

/** A name that the server takes, of that of a file. */
const nameOf = (file) =>
  file
    .replace(/\.toml$/i, "")
    .toLowerCase()
    .replace(/[^a-z0-9]+/g, "_")
    .replace(/^_+|_+$/g, "");

function stackInWords({ id, name, state, reason, pause_s, loaded_by, loaded_ms, steps }) {
  const gone = steps.filter((step) => step.state !== "ready").length;
  const pause = pause_s > 0 ? `, pauses ${Math.ceil(pause_s)} s` : "";
  const now = `${name || `Stack ${id}`}: ${state}${reason ? ` (${reason})` : ""}${pause}`;
  const from = `loaded ${inZone(loaded_ms)} by ${loaded_by}`;
  return `${now}; ${gone} of ${steps.length} steps; ${from}`;
}

function lineOf(step, next) {
  const { place, state, reason, id, became } = step;
  const how = { class: "t-stack__next", role: "img", "aria-label": "next" };
  const mark = place === next ? h("span", how, "▶ ") : "";
  return h(
    "tr",
    { "data-state": state, "data-place": String(place) },
    h("td", { class: "t-stack__place" }, mark, String(place)),
    h("td", { class: "t-stack__step" }, stepInWords(step)),
    h("td", { class: "t-stack__state" }, reason ? `${state}: ${reason}` : state),
    h("td", {}, id ? `${id} ${became}` : ""),
    h("td", {}, waitInWords(step)),
  );
}

function stepInWords({ command, values, comment }) {
  const note = comment ? h("span", { class: "t-note" }, `# ${comment}`) : null;
  if (!command) return note;
  const text = [command, valuesInWords(values)].filter(Boolean).join(" ");
  return h("span", {}, text, note ? h("br") : null, note);
}

function waitInWords({ command, wait_for, pause_s, delay_s, at, at_s }) {
  const parts = [
    at_s ? `${at_s} s after the start` : "",
    command && wait_for !== "none" ? wait_for : "",
    pause_s ? `pause ${pause_s} s` : "",
    delay_s ? `on board after ${delay_s} s` : "",
    at ? `on board at ${at}` : "",
  ];
  return parts.filter(Boolean).join(", ");
}
