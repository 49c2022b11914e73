// Plots of a run over hours: its own lines, pinned runs dashed, the band of the starts behind.

import { h } from "/dom.js";
import { plotByKeys } from "./keys.js";
import { t } from "./words.js";

const COLOURS = ["#74c0fc", "#ff8787", "#8ce99a", "#b197fc", "#ffd43b"];
const PINNED = ["#e599f7", "#ffa94d", "#63e6be", "#adb5bd"];
const GRID = { stroke: "#242c37", width: 1 };
const HEIGHT = 250;
const NARROW = 700;

// The processor draws the canvases, for which uPlot has no option: where the graphics card is an
// emulated one, drawing them by it takes most of the time of a change (design/0017-board.md).
const contextOf = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  const own = kind === "2d" ? { willReadFrequently: true } : {};
  return contextOf.call(this, kind, { ...own, ...options });
};

export class Plots {
  #box;
  #hover;
  #plots = new Map();
  #sync = window.uPlot.sync("board");

  /** `hover(hours)`: the pointer is at a time; null: it has left. */
  constructor(box, hover) {
    this.#box = box;
    this.#hover = hover;
    new ResizeObserver(() => this.#fit()).observe(box);
  }

  show(run, pins, band) {
    const panels = run.header.panels;
    for (const [key, plot] of this.#plots)
      if (!panels.some((panel) => panel.key === key)) this.#drop(key, plot);
    for (const panel of panels) this.#panel(panel, run, pins, panel.key === "rate" ? band : null);
  }

  #drop(key, plot) {
    plot.chart.destroy();
    plot.box.remove();
    this.#plots.delete(key);
  }

  #panel(panel, run, pins, band) {
    const shared = pins.filter((pin) => pin.run.arrays[panel.key]);
    const shape = `${panel.lines.length} ${shared.map((pin) => pin.name)} ${Boolean(band)} ${panel.title}`;
    const data = aligned(panel, run, shared, band);
    const plot = this.#plots.get(panel.key);
    if (plot?.shape === shape) return plot.chart.setData(data);
    const box = plot?.box ?? h("div", { class: "plot" });
    box.dataset.panel = panel.key;
    plot?.chart.destroy();
    const chart = new window.uPlot(this.#options(panel, shared, band), data, box);
    if (!plot) this.#box.append(box);
    plotByKeys(chart, panel);
    this.#plots.set(panel.key, { box, chart, shape });
  }

  #options(panel, pins, band) {
    const isRate = panel.key === "rate";
    const own = panel.lines.map((label, i) => ({
      label,
      stroke: COLOURS[i],
      width: i || !isRate ? 1 : 2,
      show: !isRate || i === 0,
    }));
    const pinned = pins.map((pin, i) => ({
      label: pin.name,
      stroke: PINNED[i % PINNED.length],
      dash: [6, 4],
      width: 1.5,
      spanGaps: true,
    }));
    const edges = band
      ? [t("least"), "5 %", t("median"), "95 %", t("greatest")].map((label, i) => ({
          label: t("starts: {part}", { part: label }),
          stroke: i === 2 ? "#dee2e6" : "#5c6b80",
          width: 1,
          spanGaps: true,
          points: { show: false },
        }))
      : [];
    const first = 1 + own.length + pinned.length;
    const bands = band
      ? [
          { series: [first + 4, first], fill: "rgba(120,150,190,0.14)" },
          { series: [first + 3, first + 1], fill: "rgba(120,150,190,0.22)" },
        ]
      : [];
    const axis = { stroke: "#93a1b5", grid: GRID, ticks: GRID };
    return {
      title: `${panel.title} [${panel.unit}]`,
      width: this.#width,
      height: this.#height,
      scales: { x: { time: false }, y: isRate ? { distr: 3 } : {} },
      axes: [{ ...axis, label: t("h"), labelSize: 18 }, { ...axis, size: 60 }],
      series: [{ label: t("h") }, ...own, ...pinned, ...edges],
      bands,
      cursor: { sync: { key: this.#sync.key }, drag: { x: true, y: false } },
      hooks: {
        setCursor: [
          (chart) => this.#hover(chart.cursor.idx === null ? null : chart.data[0][chart.cursor.idx]),
        ],
      },
    };
  }

  get #width() {
    return Math.max(240, this.#box.clientWidth - 26);
  }

  get #height() {
    return window.innerWidth <= NARROW ? 170 : HEIGHT;
  }

  #fit() {
    const size = { width: this.#width, height: this.#height };
    for (const { chart } of this.#plots.values())
      if (chart.width !== size.width || chart.height !== size.height) chart.setSize(size);
  }
}

const hours = (seconds) => Array.from(seconds, (t) => t / 3600);

function columns({ shape: [rows, lines], values }) {
  return Array.from({ length: lines }, (_, j) => {
    const column = new Array(rows);
    for (let i = 0; i < rows; i++) column[i] = values[i * lines + j];
    return column;
  });
}

/** Lines of run, pins and band over one common time; a logarithmic axis takes no zeros. */
function aligned({ key }, run, pins, band) {
  const shown = (column) => (key === "rate" ? column.map((x) => (x > 0 ? x : null)) : column);
  const times = ({ arrays }) => hours(arrays[`${key}.t_s`].values);
  const tables = [[times(run), ...columns(run.arrays[key]).map(shown)]];
  for (const pin of pins)
    tables.push([times(pin.run), shown(columns(pin.run.arrays[key])[0])]);
  if (band) tables.push([hours(band.t_s), ...band.rate_deg_s.map(shown)]);
  return tables.length === 1 ? tables[0] : window.uPlot.join(tables);
}
