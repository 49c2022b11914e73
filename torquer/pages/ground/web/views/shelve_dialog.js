// For how long an alarm is shelved, and why.

import { h } from "../dom.js";

const TIMES = [
  ["15 minutes", 900],
  ["1 hour", 3600],
  ["8 hours", 28_800],
  ["1 day", 86_400],
  ["7 days", 604_800],
];

/** `shelve(alarm, seconds, reason)` is called with what was chosen. */
export class ShelveDialog {
  #alarm = null;
  #what = h("p", {});
  #time = h(
    "select",
    { name: "time" },
    TIMES.map(([text, seconds]) => h("option", { value: seconds }, text)),
  );
  #reason = h("input", { type: "text", name: "reason", required: true, maxLength: 500 });

  constructor(shelve) {
    const form = h(
      "form",
      { method: "dialog" },
      h("h2", {}, "Shelve"),
      this.#what,
      h("label", {}, "For ", this.#time),
      h("label", {}, "Reason ", this.#reason),
      h(
        "div",
        { class: "t-bar" },
        h("button", { type: "submit", class: "t-send" }, "Shelve"),
        h("button", { type: "button", onclick: () => this.element.close() }, "Cancel"),
      ),
    );
    form.onsubmit = () => shelve(this.#alarm, Number(this.#time.value), this.#reason.value.trim());
    this.element = h("dialog", { class: "t-dialog", "aria-label": "Shelve an alarm" }, form);
  }

  open(alarm) {
    this.#alarm = alarm;
    this.#what.textContent = `${alarm.key} calls for nobody meanwhile.`;
    this.#reason.value = "";
    this.element.showModal();
    this.#reason.focus();
  }
}
