// Commands that were sent, with what became of each, live.

import { h, oncePerFrame } from "../dom.js";
import { get, inBackground, post, route } from "../net/api.js";
import { mayCommand } from "../net/role.js";
import { inZone, inZoneToday } from "../times.js";
import { titledLine } from "./titled.js";

/** Most commands shown: the last ones. */
const MOST = 200;
const TITLES = ["No.", "Command", "Values", "State", "Made", "Sent", "Answered", "By"];

export class SentList {
  #context;
  #commands = new Map();
  #body = h("tbody");

  constructor(context) {
    this.#context = context;
    const head = h(
      "tr",
      {},
      TITLES.map((title) => h("th", { scope: "col" }, title)),
    );
    this.element = h(
      "section",
      { class: "t-sent t-folds t-scroll", tabindex: 0 },
      h("table", { class: "t-table" }, h("thead", {}, head), this.#body),
    );
    this.redraw = oncePerFrame(() => this.#draw(), context.signal);
  }

  async start() {
    const { live, satellite, signal } = this.#context;
    const ofSatellite = (commands) => commands.filter((one) => one.satellite === satellite.key);
    live.on("commands", (commands) => this.put(ofSatellite(commands)), signal);
    live.on("again", () => inBackground(this.#ask(), signal), signal);
    await this.#ask();
  }

  put(commands) {
    for (const command of commands) {
      // The answer to the request may come after the first news of the command.
      const known = this.#commands.get(command.id);
      if (!known || progress(command) >= progress(known)) this.#commands.set(command.id, command);
    }
    const oldest = [...this.#commands.keys()].sort((a, b) => b - a).slice(MOST);
    for (const id of oldest) this.#commands.delete(id);
    this.redraw();
  }

  async #ask() {
    const { satellite, signal } = this.#context;
    this.put(await get(route(satellite.key, "sent"), { size: MOST }, signal));
  }

  #draw() {
    const sorted = [...this.#commands.values()].sort((a, b) => b.id - a.id);
    this.#body.replaceChildren(...sorted.map((one) => lineOf(one, () => this.#cancel(one))));
  }

  /** Has a command cancelled that waits, here or on board; why it cannot be stands in its state. */
  async #cancel(command) {
    const path = route(this.#context.satellite.key, "commands", String(command.id), "cancel");
    try {
      this.put([await post(path, {})]);
    } catch (error) {
      this.put([{ ...command, reason: error.message }]);
    }
  }
}

/** States in which a command can be cancelled. */
const WAITS = ["waiting", "received"];

/** How far a command has come. */
function progress({ sent_ms, received_ms, answered_ms, state }) {
  const isOver = ["executed", "refused", "unanswered", "cancelled"].includes(state);
  return [sent_ms, received_ms, answered_ms].filter(Boolean).length + (isOver ? 1 : 0);
}

function lineOf(command, cancel) {
  const { id, state, made_ms, sent_ms, answered_ms } = command;
  const canCancel = mayCommand() && WAITS.includes(state);
  const how = { type: "button", class: "t-button", onclick: cancel };
  const button = canCancel && h("button", how, "Cancel");
  const stateCell = h("td", { class: "t-sent__state" }, stateInWords(command), " ", button || "");
  const cells = [
    String(id),
    command.command,
    h("td", { class: "t-sent__values" }, valuesInWords(command.values)),
    stateCell,
    ...[made_ms, sent_ms, answered_ms].map(timeCell),
    command.by ?? command.made_by ?? "",
  ];
  return titledLine(TITLES, cells, { "data-state": state, "data-command": command.command });
}

/** A time without the date where it is today's; in full to who points at it. */
export const timeCell = (time) => h("td", { title: inZone(time) }, inZoneToday(time));

function stateInWords({ state, reason, execute_ms, answered_ms }) {
  if (reason) return `${state}: ${reason}`;
  const isDelayed = execute_ms && !answered_ms;
  return isDelayed ? `${state}, to be executed ${inZone(execute_ms)} on board` : state;
}

export const valuesInWords = (values) =>
  Object.entries(values ?? {})
    .map(([name, value]) => `${name} = ${Array.isArray(value) ? value.join(", ") : value}`)
    .join("; ");
