// The command panel: what can be sent, a form, and what became of what was sent.

import { h } from "../dom.js";
import { get, route } from "../net/api.js";
import { CommandForm } from "./command_form.js";
import { SentList } from "./sent_list.js";

export async function showCommands(element, context) {
  const { satellite, signal } = context;
  const { commands, regions } = await get(route(satellite.key, "commands"), {}, signal);
  const sent = new SentList(context);
  const form = new CommandForm(satellite, regions, (command) => sent.put([command]));
  const list = new CommandList(commands, (command) => form.open(command));
  element.append(h("div", { class: "t-commands" }, list.element, form.element, sent.element));
  await sent.start();
}

/** Commands by module, with a search. */
class CommandList {
  #entries;
  #search = h("input", { type: "search", placeholder: "search", "aria-label": "Search", oninput: () => this.#filter() });

  constructor(commands, chosen) {
    this.#entries = commands.map((command) => this.#entry(command, chosen));
    const modules = [...new Set(commands.map(({ module }) => module))];
    const groups = modules.map((module) =>
      h(
        "section",
        {},
        h("h3", { class: "t-heading" }, module || "commands"),
        this.#entries
          .filter(({ command }) => command.module === module)
          .map(({ button }) => button),
      ),
    );
    this.element = h(
      "nav",
      { class: "t-commands__list", "aria-label": "Commands" },
      this.#search,
      h("div", { class: "t-scroll", tabindex: 0 }, groups),
    );
  }

  #entry(command, chosen) {
    const onclick = () => {
      for (const one of this.#entries) one.button.removeAttribute("aria-current");
      button.setAttribute("aria-current", "true");
      chosen(command);
    };
    const { name, description } = command;
    const how = { class: "t-command", type: "button", title: description, "data-command": name };
    const button = h("button", { ...how, onclick }, name, h("small", {}, description));
    return { command, button };
  }

  #filter() {
    const wanted = this.#search.value.toLowerCase();
    for (const { command, button } of this.#entries)
      button.hidden = !`${command.name} ${command.description}`.toLowerCase().includes(wanted);
    for (const section of this.element.querySelectorAll("section"))
      section.hidden = !section.querySelector("button:not([hidden])");
  }
}
