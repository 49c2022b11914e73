// The page's script on a page of fakes: node fake_page.js SCRIPT TRIAL prints what was drawn, as JSON.
"use strict";
const { readFileSync } = require("node:fs");
const { gzipSync } = require("node:zlib");
const vm = require("node:vm");

const [, , script, trial] = process.argv;
const packed = text => gzipSync(text).toString("base64");
const log = [], idle = [], timers = [], handlers = {}, boxes = [];
let observer, dark = false;

function element(folded = null) {
  const attributes = {};
  return {
    style: {}, classList: { add() {} }, handlers: {}, folded,
    append(child) { child.parentNode = this; },
    setAttribute(name, value) { attributes[name] = value; },
    hasAttribute: name => name in attributes,
    addEventListener(name, call) { this.handlers[name] = call; },
    closest() { return this.folded && !this.folded.open ? this.folded : null; },
    on(name, call) { this.handlers[name] = call; },
  };
}

function plot(number, folded) {
  const layout = { height: 300, margin: {}, font: { size: 12 }, xaxis: { range: [0, 10] } };
  if (trial === "keys" && number === 1) delete layout.xaxis.range;
  const figure = { data: [], layout: { ...layout, meta: number } };
  const box = element(folded);
  box.querySelector = () => ({ textContent: packed(JSON.stringify(figure)) });
  if (trial !== "keys") box.setAttribute("data-linked", "");
  boxes.push(box);
}

globalThis.Fake = {
  newPlot(stage, figure) {
    stage.number = figure.layout.meta;
    log.push(["draw", stage.number, figure.layout.font.color]);
    stage.layout = figure.layout;
    if (!stage.layout.xaxis.range) stage.layout.xaxis.range = [0, 7];
    stage.parentNode.stage = stage;
    return Promise.resolve(stage);
  },
  relayout(stage, change) {
    log.push(["zoom", stage.number, change["xaxis.range"] || "all"]);
    if (change["xaxis.range"]) stage.layout.xaxis.range = change["xaxis.range"];
    if (stage.handlers.plotly_relayout) stage.handlers.plotly_relayout(change);
    return Promise.resolve(stage);
  },
};

const details = { open: false };
[0, 1, 2].forEach(number => plot(number, null));
plot(3, details);
globalThis.document = {
  createElement: () => element(),
  getElementById: id => (id === "plotly" ? { textContent: packed("globalThis.Plotly = Fake;") }
    : { querySelector: () => details }),
  head: { append: made => vm.runInThisContext(made.textContent) },
  querySelectorAll: kind => (kind === ".plot" ? boxes : boxes.map(box => box.stage)),
};
globalThis.window = globalThis;
globalThis.location = { hash: trial === "link" ? "#logs" : "" };
globalThis.innerWidth = 1200;
globalThis.matchMedia = () => ({ get matches() { return dark; }, addEventListener() {} });
globalThis.addEventListener = (name, call) => { handlers[name] = call; };
globalThis.IntersectionObserver = class {
  constructor(call) { observer = call; }
  observe() {}
};
if (trial !== "no idle callbacks")
  globalThis.requestIdleCallback = call => { idle.push(call); };

const wait = globalThis.setTimeout;
const settled = () => new Promise(done => wait(done, 20));
const drawn = () => log.filter(([what]) => what === "draw").map(([, number]) => number);
const scroll = (number, isIntersecting = true) =>
  observer([{ target: boxes[number], isIntersecting }]);

async function rest(calls) {
  const steps = [];
  while (calls.length) {
    const before = drawn().length;
    calls.shift()();
    steps.push(drawn().length - before);
    await settled();
  }
  return steps;
}

const trials = {
  async idle() {
    const first = drawn(), steps = await rest(idle);
    return { first, steps, drawn: drawn() };
  },
  async "no idle callbacks"() {
    const steps = await rest(timers);
    return { steps, drawn: drawn() };
  },
  async print() {
    handlers.beforeprint();
    const printed = drawn();
    return { printed, again: (handlers.beforeprint(), drawn()), steps: await rest(idle) };
  },
  async fold() {
    await rest(idle);
    const closed = drawn();
    details.open = true;
    handlers.toggle();
    await rest(idle);
    return { closed, opened: drawn() };
  },
  async zoom() {
    scroll(1);
    const seen = drawn();
    await rest(idle);
    log.length = 0;
    boxes[1].stage.handlers.plotly_relayout({ "xaxis.range": [2, 3] });
    const atOnce = log.slice();
    scroll(2);
    const scrolled = log.slice();
    await settled();
    await rest(idle);
    const all = log.slice();
    scroll(0);
    log.length = 0;
    boxes[2].stage.handlers.plotly_relayout({ "xaxis.autorange": true });
    return { seen, atOnce, scrolled, all, back: log.slice() };
  },
  async link() {
    await rest(idle);
    return drawn();
  },
  async keys() {
    await rest(idle);
    log.length = 0;
    for (const box of [boxes[0], boxes[1]])
      for (const key of ["+", "0"]) box.handlers.keydown({ key, preventDefault() {} });
    return log;
  },
  async dark() {
    await rest(idle);
    return log;
  },
};

(async () => {
  dark = trial === "dark";
  globalThis.setTimeout = call => { timers.push(call); };
  vm.runInThisContext(readFileSync(script, "utf-8"));
  while (!observer) await settled();
  console.log(JSON.stringify(await trials[trial]()));
  process.exit(0);
})();
