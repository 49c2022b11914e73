// The history of commands: who, when, what became of each; filtered, and as a file.

import { h, oncePerFrame } from "../dom.js";
import { get, inBackground, route } from "../net/api.js";
import { timeCell, valuesInWords } from "./sent_list.js";
import { titledLine } from "./titled.js";

/** Commands of a page; more are asked for. */
const PAGE = 200;
/** Most commands of a file; the span narrows what is in it. */
const MOST = 20_000;
const STATES = ["waiting", "sent", "received", "executed", "refused", "unanswered", "cancelled"];
const TIMES = ["Made", "Sent", "Received", "Answered", "Execution (on board)"];
const TITLES = ["No.", "Command", "Values", "State", ...TIMES, "By (as stated)"];

export function showCommandHistory(element, context) {
  const view = new CommandHistory(context);
  element.append(view.element);
  return view.start();
}

class CommandHistory {
  #context;
  #commands = [];
  #asked = 0;
  #command = this.#field("search", "command");
  #by = this.#field("search", "by");
  #start = this.#field("datetime-local", "start");
  #end = this.#field("datetime-local", "end");
  #state = h(
    "select",
    { name: "state", onchange: () => this.ask() },
    h("option", { value: "" }, "any"),
    STATES.map((state) => h("option", { value: state }, state)),
  );
  #body = h("tbody");
  #note = h("p", { class: "t-note", role: "status" });
  #error = h("p", { class: "t-failure", role: "alert" });
  #more = button("Older ones", () => this.#askMore());

  constructor(context) {
    this.#context = context;
    this.#more.hidden = true; // until it is known that there are some
    const head = h("tr", {}, TITLES.map((title) => h("th", { scope: "col" }, title)));
    const table = h("table", { class: "t-table" }, h("thead", {}, head), this.#body);
    const save = (form) => button(form.toUpperCase(), () => this.#save(form));
    const label = (text, input) => h("label", {}, `${text} `, input);
    this.element = h(
      "div",
      { class: "t-history t-folds t-scroll" },
      h(
        "div",
        { class: "t-bar" },
        label("Command", this.#command),
        label("State", this.#state),
        label("By", this.#by),
        label("From (UTC)", this.#start),
        label("to", this.#end),
        save("csv"),
        save("json"),
      ),
      this.#error,
      this.#note,
      h("div", { class: "t-wide", tabIndex: 0, role: "region", "aria-label": "Commands" }, table),
      this.#more,
    );
    this.ask = oncePerFrame(() => inBackground(this.#ask(), context.signal), context.signal);
  }

  async start() {
    const { live, satellite, signal } = this.#context;
    const isOurs = (one) => one.satellite === satellite.key;
    live.on("commands", (all) => all.some(isOurs) && this.ask(), signal);
    live.on("again", () => this.ask(), signal);
    await this.#ask();
  }

  #field(type, name) {
    return h("input", { type, name, step: 1, oninput: () => this.ask() });
  }

  /** What is asked for, by the names of the route. */
  #wanted() {
    const found = {
      command: this.#command.value.trim(),
      state: this.#state.value,
      by: this.#by.value.trim(),
      start: timeOf(this.#start),
      end: timeOf(this.#end),
    };
    return Object.fromEntries(Object.entries(found).filter(([, value]) => value !== ""));
  }

  get #path() {
    return route(this.#context.satellite.key, "command-history");
  }

  async #ask() {
    const asked = ++this.#asked;
    // As many as are shown, so that news do not fold away what was opened.
    const size = Math.max(PAGE, Math.min(this.#commands.length, 20 * PAGE));
    await this.#take(asked, { size }, []);
  }

  async #askMore() {
    const last = this.#commands[this.#commands.length - 1];
    await this.#take(++this.#asked, { size: PAGE, before: last.id }, this.#commands);
  }

  async #take(asked, span, before) {
    try {
      const wanted = { ...this.#wanted(), ...span };
      const found = await get(this.#path, wanted, this.#context.signal);
      if (asked !== this.#asked) return; // something else was asked for meanwhile
      this.#commands = [...before, ...found];
      this.#error.textContent = "";
      this.#more.hidden = found.length < span.size;
      this.#draw();
    } catch (error) {
      if (!this.#context.signal.aborted) this.#error.textContent = error.message;
    }
  }

  #draw() {
    const count = this.#commands.length;
    const more = this.#more.hidden ? "" : ", and older ones";
    const commands = count === 1 ? "command" : "commands";
    this.#note.textContent = `${count || "no"} ${commands}${more}, newest first`;
    this.#body.replaceChildren(...this.#commands.map(lineOf));
  }

  /** Saves the last ones that are asked for, not only those that are shown. */
  #save(format) {
    const query = new URLSearchParams({ ...this.#wanted(), size: MOST, format });
    const name = `${this.#context.satellite.key}-commands.${format}`;
    h("a", { href: `${this.#path}?${query}`, download: name }).click();
  }
}

const button = (text, onclick) =>
  h("button", { type: "button", class: "t-button", onclick }, text);

/** Milliseconds since 1970 of a field that is taken for UTC. */
function timeOf({ value }) {
  const time = value ? Date.parse(`${value}Z`) : NaN;
  return Number.isNaN(time) ? "" : time;
}

function lineOf(command) {
  const { id, state, reason, values, made_by } = command;
  const times = ["made_ms", "sent_ms", "received_ms", "answered_ms", "execute_ms"];
  const cells = [
    String(id),
    command.command,
    h("td", { class: "t-sent__values" }, valuesInWords(values)),
    h("td", { class: "t-sent__state" }, reason ? `${state}: ${reason}` : state),
    ...times.map((key) => timeCell(command[key])),
    made_by,
  ];
  return titledLine(TITLES, cells, { "data-state": state, "data-command": command.command });
}
