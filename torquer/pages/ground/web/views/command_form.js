// The form of one command, made from its fields.

import { h } from "../dom.js";
import { post, route } from "../net/api.js";
import { mayCommand } from "../net/role.js";
import { inputOf } from "./fields.js";
import { operatorLine } from "./operator.js";

export class CommandForm {
  #satellite;
  #regions;
  #sent;
  #command = null;
  #inputs = [];
  #delay = h("input", { type: "number", min: 0, step: "any", placeholder: "at once" });
  #acknowledge = h("input", { type: "checkbox", checked: true });
  #error = h("p", { class: "t-failure", role: "alert" });

  /** `sent(command)` is called with a command that the server has taken. */
  constructor(satellite, regions, sent) {
    this.#satellite = satellite;
    this.#regions = regions;
    this.#sent = sent;
    const note = h("p", { class: "t-note" }, "Choose a command in the list.");
    this.element = h(
      "form",
      { class: "t-form t-scroll", onsubmit: (event) => this.#submit(event) },
      note,
    );
    this.element.noValidate = true;
  }

  open(command) {
    this.#command = command;
    this.#inputs = command.fields.map((field) => inputOf(field, this.#regions));
    const region = this.#inputs.find(({ name }) => name === "region");
    const state = this.#inputs.find(({ name }) => name === "state");
    if (region && state) region.onChange(() => state.choose(this.#regions[region.value()] ?? []));
    this.#error.textContent = "";
    // How the last command was sent says nothing about this one.
    this.#delay.value = "";
    this.#acknowledge.checked = true;
    this.element.replaceChildren(
      h("h2", {}, command.name),
      h("p", { class: "t-note" }, command.description),
      ...this.#inputs.map(({ element }) => element),
      this.#execution(),
      operatorLine(),
      h(
        "button",
        { class: "t-send", type: "submit", disabled: !mayCommand() },
        `Send ${command.name}`,
      ),
      this.#error,
    );
  }

  #execution() {
    return h(
      "fieldset",
      { class: "t-field t-field--how" },
      h("label", {}, "Execution delay ", this.#delay, " s"),
      h("label", {}, this.#acknowledge, " ask for an acknowledgement"),
    );
  }

  async #submit(event) {
    event.preventDefault();
    if (!mayCommand()) return;
    this.#error.textContent = "";
    try {
      const values = Object.fromEntries(this.#inputs.map((one) => [one.name, one.value()]));
      const body = { command: this.#command.name, values, acknowledge: this.#acknowledge.checked };
      if (this.#delay.value !== "") body.delay_s = Number(this.#delay.value);
      this.#sent(await post(route(this.#satellite.key, "commands"), body));
    } catch (error) {
      this.#error.textContent = error.message;
    }
  }
}
