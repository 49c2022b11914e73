// The scenario's own Python files beside their plots: edited, saved, simulated again.

import { h } from "/dom.js";
import { post } from "./net.js";
import { t } from "./words.js";

export class Code {
  #files = [];
  #box;
  #saved;
  #text = h("textarea", { spellcheck: false, wrap: "off", "aria-label": t("text of the Python file") });
  #select = h("select", { "aria-label": t("Python file") });
  #failure = h("p", { class: "failure", role: "alert" });
  #state = h("span", { role: "status" });

  /** `saved()`: a file was replaced. */
  constructor(box, saved) {
    this.#box = box;
    this.#saved = saved;
    const save = h("button", { onclick: () => this.#save(), title: "Ctrl-S" }, t("save and simulate"));
    const read = h("button", { onclick: () => this.#read() }, t("read again"));
    const row = h("div", { class: "row" }, this.#select, save, read, this.#state);
    box.append(row, this.#failure, this.#text);
    this.#select.onchange = () => this.#show();
    this.#text.oninput = () => {
      this.#file.edited = this.#text.value;
      this.#say();
    };
    box.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "s") return;
      event.preventDefault();
      this.#save();
    });
    addEventListener("beforeunload", (event) => this.#files.some(isEdited) && event.preventDefault());
  }

  /** Reads the files; whether there is one. */
  async begin() {
    await this.#read();
    this.#select.hidden = this.#files.length < 2;
    return this.#files.length > 0;
  }

  /** Shows the first of the mistakes that are about a file, in a line. */
  mistakes(errors) {
    const about = ({ key, text }) =>
      this.#files.some(({ name }) => text.includes(name)) || /(^|\.)(file|function)$/.test(key);
    this.#failure.textContent = errors.find(about)?.text ?? "";
  }

  get #file() {
    return this.#files[this.#select.selectedIndex];
  }

  async #read() {
    const index = Math.max(0, this.#select.selectedIndex);
    ({ files: this.#files } = await post("code", {}));
    this.#select.replaceChildren(...this.#files.map(({ name }) => h("option", {}, name)));
    this.#select.selectedIndex = Math.min(index, this.#files.length - 1);
    this.#failure.textContent = "";
    if (this.#files.length) this.#show();
  }

  #show() {
    this.#text.value = this.#file.edited ?? this.#file.text;
    this.#say();
  }

  #say() {
    this.#state.textContent = `${this.#file.name}: ${isEdited(this.#file) ? t("not saved") : t("saved")}`;
  }

  async #save() {
    const file = this.#file;
    try {
      const { name, mark } = file;
      Object.assign(file, await post("edit", { name, mark, text: this.#text.value }));
      delete file.edited;
      this.#failure.textContent = "";
      this.#say();
      this.#saved();
    } catch (error) {
      this.#failure.textContent = error.message;
    }
  }
}

const isEdited = ({ text, edited }) => edited !== undefined && edited !== text;
