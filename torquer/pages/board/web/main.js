// The board: data of a scenario, flown at each change; the latest wins.

import { h } from "/dom.js";
import { Code } from "./code.js";
import { fromAddress, History, toAddress, withValue } from "./data.js";
import { Form } from "./form.js";
import { fly, Latest, lines, post, Refused } from "./net.js";
import { Plots } from "./plots.js";
import { t } from "./words.js";

/** How long a superseded request may go on [ms]. */
const PATIENCE_MS = 150;
/** Quiet time before theory is asked for, the 3D view drawn and the address changed [ms]. */
const QUIET_MS = 250;
const MOST_PINS = 4;
const at = (id) => document.getElementById(id);

const history_ = new History({});
const pins = [];
let band = null;
let run = null;
let wrong = [];
let view = null;
let asked = 0;
let changedAt = 0;
let quiet = 0;
let viewing = 0;
/** For measurements: milliseconds from a change to its picture, counts of requests, what is shown. */
const measured = (window.board = {
  redraws: [],
  drawn: 0,
  data: () => history_.now,
  flownData: () => run.data,
  shown: () => [...run.arrays.rate.values].filter((_, i) => i % 4 === 0),
});

const form = new Form(at("form"), (key, value, isStructure) => {
  change(withValue(history_.now, key, value), isStructure ? null : key, isStructure);
});
const plots = new Plots(at("plots"), (hours) => view?.at(hours));
const code = new Code(at("code"), () => refresh(false));
const flights = new Latest(flown, PATIENCE_MS);
const theories = new Latest(withTheory, 0);
measured.counts = flights.counts;

function change(data, key, isStructure) {
  history_.put(data, key);
  refresh(isStructure);
}

function refresh(isStructure) {
  changedAt = performance.now();
  stale(true);
  stopStarts();
  flights.ask({ data: history_.now, at: changedAt, number: ++asked });
  at("undo").disabled = !history_.canUndo;
  at("redo").disabled = !history_.canRedo;
  if (isStructure) showForm();
  clearTimeout(viewing);
  clearTimeout(quiet);
  quiet = setTimeout(whenQuiet, QUIET_MS);
}

async function whenQuiet() {
  theories.ask(history_.now);
  history.replaceState(null, "", await toAddress(history_.now));
}

async function showForm() {
  const data = history_.now;
  const { tables } = await post("form", { data });
  if (data !== history_.now) return;
  form.show(tables);
  errors(wrong); // they may have come before the fields next to which they stand
}

async function flown({ data, at: since, number }, signal) {
  say(t("computing"));
  try {
    const found = await fly(data, signal);
    run = { ...found, data };
    errors([]);
    draw();
    if (number === asked) stale(false);
    shownNext(since, number); // not waited for: the next request may begin
  } catch (error) {
    if (signal.aborted) return;
    errors(error instanceof Refused ? error.errors : [{ key: "", text: String(error.message) }]);
    say(t("not flown: the plots are of the last run"));
  }
}

/** Notes what a change took once its picture is there, and lets the 3D view follow. */
async function shownNext(since, number) {
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  const now = performance.now();
  measured.firstDrawnAt ??= now;
  measured.drawn++;
  measured.redraws.push(now - since);
  if (measured.redraws.length > 1000) measured.redraws.shift();
  if (number !== asked) return;
  say(`${(now - since).toFixed(0)} ${t("ms")}`);
  viewing = setTimeout(showView, changedAt + QUIET_MS - now);
}

async function withTheory(data, signal) {
  try {
    const found = await post("theory", { data }, signal);
    at("theory").tBodies[0].replaceChildren(...found.lines.map(lineOf));
    at("notes").replaceChildren(...found.notes.map((note) => h("li", {}, note)));
    at("theory").classList.remove("is-stale");
  } catch (error) {
    if (!(error instanceof Refused) && !signal.aborted) throw error;
  }
}

function lineOf({ name, value, unit, about }) {
  const text = value === null ? t("none") : `${Number(value.toPrecision(4))} ${unit}`;
  return h("tr", {}, h("td", {}, name, h("small", {}, about)), h("td", { class: "value" }, text));
}

function draw() {
  plots.show(run, pins, band);
  const { verdict } = run.header;
  at("verdict").textContent = [verdict.headline, ...verdict.limits_met].join(" ");
  at("verdict").dataset.done = verdict.done;
  showPins();
}

// without a graphics card the 3D view takes longer than all plots
function showView() {
  view?.show(run);
  at("view").classList.remove("is-stale");
}

function errors(found) {
  wrong = found;
  code.mistakes(found);
  at("errors").replaceChildren(...form.mistakes(found).map((each) => h("li", {}, each.text)));
}

/** What is drawn with the plots; theory and the 3D view say themselves when they are not stale. */
function stale(is) {
  for (const id of ["plots", "verdict"]) at(id).classList.toggle("is-stale", is);
  if (is) for (const id of ["view", "theory"]) at(id).classList.add("is-stale");
}

function say(text) {
  at("state").textContent = text;
}

// Pins

at("pin").onclick = () => {
  if (!run) return;
  const number = 1 + Math.max(0, ...pins.map((pin) => pin.number));
  const name = t("pin {number}", { number });
  pins.push({ name, number, run, data: history_.now });
  if (pins.length > MOST_PINS) pins.shift();
  draw();
};

function showPins() {
  const rows = pins.length ? [...pins, { name: t("now"), isNow: true, run, data: history_.now }] : [];
  at("pins").hidden = !rows.length;
  at("pins").tBodies[0].replaceChildren(...rows.map(pinOf));
}

function pinOf(pin) {
  const { numbers, verdict } = pin.run.header;
  const settled = verdict.settled_s === null ? t("not settled") : `${(verdict.settled_s / 3600).toFixed(2)} ${t("h")}`;
  const rate = `${Number(numbers.final_rate_deg_s.toPrecision(3))} ${t("deg/s")}`;
  const differs = pin.isNow ? "" : differences(pin.data, history_.now).slice(0, 3).join(", ");
  const row = h("tr", {}, h("td", {}, pin.name, h("small", {}, differs)), h("td", { class: "value" }, settled), h("td", { class: "value" }, rate));
  const buttons = h("td", {});
  if (!pin.isNow)
    buttons.append(
      h("button", { onclick: () => change(pin.data, null, true), "aria-label": t("use {name}", { name: pin.name }) }, t("use")),
      h("button", { onclick: () => (pins.splice(pins.indexOf(pin), 1), draw()), "aria-label": t("remove {name}", { name: pin.name }) }, "×"),
    );
  row.append(buttons);
  return row;
}

/** Keys in which data differ, with the value of the first. */
function differences(one, other, place = "") {
  const keys = new Set([...Object.keys(one ?? {}), ...Object.keys(other ?? {})]);
  return [...keys].flatMap((key) => {
    const [a, b] = [one?.[key], other?.[key]];
    if (JSON.stringify(a) === JSON.stringify(b)) return [];
    const isTable = [a, b].every((x) => x && typeof x === "object" && !Array.isArray(x));
    return isTable ? differences(a, b, `${place}${key}.`) : [`${key} ${JSON.stringify(a) ?? t("none")}`];
  });
}

// Starts

let starting = null;

function stopStarts() {
  starting?.abort();
  starting = null;
  band = null;
  at("starts").textContent = t("256 starts");
}

at("starts").onclick = async () => {
  if (starting) {
    stopStarts();
    if (run) draw();
    return;
  }
  const control = (starting = new AbortController());
  at("starts").textContent = t("starts: beginning");
  try {
    await lines("starts", { data: history_.now }, control.signal, (line) => {
      if (starting !== control) return;
      if (line.errors) return errors(line.errors);
      band = line;
      at("starts").textContent = t("starts: {flown} of {runs}", line);
      if (run) draw();
    });
  } catch (error) {
    if (!control.signal.aborted && error instanceof Refused) errors(error.errors);
  }
};

for (const button of document.querySelectorAll("[data-to]"))
  button.onclick = () => at(button.dataset.to).focus();

// Undo

const step = (how) => {
  history_[how]();
  refresh(true);
};
at("undo").onclick = () => step("undo");
at("redo").onclick = () => step("redo");
addEventListener("keydown", (event) => {
  const isText = event.target.matches?.("textarea, input[type=text]");
  if (isText || !(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
  event.preventDefault();
  const how = event.shiftKey ? "redo" : "undo";
  if (history_[how === "undo" ? "canUndo" : "canRedo"]) step(how);
});

// The scenario's Python files, in place of the form

at("edit").onclick = () => {
  const isOpen = at("code").hidden;
  at("code").hidden = !isOpen;
  at("form").hidden = isOpen;
  document.querySelector("main").classList.toggle("is-editing", isOpen);
  at("edit").setAttribute("aria-expanded", isOpen);
  if (isOpen) at("code").querySelector("textarea").focus();
};

// TOML

const dialog = at("text");
const area = dialog.querySelector("textarea");
const failure = dialog.querySelector(".failure");
const DO = {
  close: () => dialog.close(),
  use: async () => {
    try {
      const { data } = await post("read", { toml: area.value });
      change(data, null, true);
      dialog.close();
    } catch (error) {
      failure.textContent = error.message;
    }
  },
  save: () => {
    const link = h("a", { download: `${history_.now.name ?? measured.name}.toml` });
    link.href = URL.createObjectURL(new Blob([area.value], { type: "text/plain" }));
    link.click();
    URL.revokeObjectURL(link.href);
  },
};
for (const button of dialog.querySelectorAll("[data-do]"))
  button.onclick = () => DO[button.dataset.do]();
dialog.querySelector("input[type=file]").onchange = async (event) => {
  const [file] = event.target.files;
  if (file) area.value = await file.text();
};
at("toml").onclick = async () => {
  failure.textContent = "";
  area.value = (await post("write", { data: history_.now })).toml;
  dialog.showModal();
};

// Start

async function start() {
  const begin = await (await fetch("/api/start")).json();
  measured.name = begin.name;
  history_.now = (await fromAddress(location.hash)) ?? begin.data;
  refresh(true);
  at("edit").hidden = !(await code.begin());
  try {
    const { View } = await import("./view.js");
    view = new View(at("view"));
    if (run) showView();
  } catch (error) {
    at("view").textContent = t("no 3D view: {why}", { why: error.message });
  }
}

addEventListener("hashchange", async () => {
  const data = await fromAddress(location.hash);
  if (data && JSON.stringify(data) !== JSON.stringify(history_.now)) change(data, null, true);
});
start().catch((error) => errors([{ key: "", text: error.message }]));
