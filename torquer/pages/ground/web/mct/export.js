// The button of plots and tables that offers what they show as files.

import { h } from "../dom.js";
import { get, route } from "../net/api.js";
import { inZone } from "../times.js";
import { NAMESPACE, TYPES } from "./objects.js";

const PLOT = "telemetry.plot.overlay";

export function installExport(openmct, satellites) {
  openmct.actions.register({
    key: "torquer.export",
    name: "Export",
    description: "Download what the archive has of this, as CSV or Parquet",
    cssClass: "icon-download",
    group: "view",
    priority: 5,
    showInStatusBar: true,
    appliesTo: ([object]) => canExport(object),
    invoke: ([object]) => show(openmct, satellites, object),
  });
}

const canExport = ({ identifier, type }) =>
  identifier?.namespace === NAMESPACE && [PLOT, TYPES.packet, TYPES.number].includes(type);

async function show(openmct, satellites, object) {
  const [formats, selections] = await Promise.all([
    get("/api/formats"),
    selectionsOf(openmct, object),
  ]);
  const { start, end } = openmct.time.getBounds();
  const isReceived = openmct.time.getTimeSystem().key === "received";
  const span = {
    start: Math.floor(start),
    end: Math.ceil(end),
    by: isReceived ? "received" : "time",
  };
  const lines = selections.map((selection) => lineOf(satellites, selection, span, formats));
  const element = h(
    "div",
    { class: "t-view t-export" },
    h("h2", {}, `Export ${object.name}`),
    h("p", {}, `${isReceived ? "Received" : "On-board time"} ${inZone(start)} to ${inZone(end)}`),
    lines,
    formats.includes("parquet") ? null : h("p", { class: "t-note" }, "Parquet needs pyarrow."),
  );
  const overlay = openmct.overlays.overlay({
    element,
    size: "fit",
    dismissible: true,
    buttons: [{ label: "Close", callback: () => overlay.dismiss() }],
  });
}

/** What an object shows: numbers of packets, all of a packet where none are named. */
async function selectionsOf(openmct, object) {
  const members =
    object.type === PLOT
      ? await Promise.all(object.composition.map((one) => openmct.objects.get(one)))
      : [object];
  const found = new Map();
  for (const { satellite, packet, number } of members) {
    const key = `${satellite}/${packet}`;
    if (!found.has(key)) found.set(key, { satellite, packet, numbers: [] });
    if (number) found.get(key).numbers.push(number);
  }
  return [...found.values()];
}

function lineOf(satellites, { satellite, packet, numbers }, span, formats) {
  const what = numbers.length ? numbers.join(", ") : "all numbers";
  const links = formats.map((format) => {
    const query = new URLSearchParams({ ...span, numbers: numbers.join(","), format });
    const href = `${route(satellite, "export", packet)}?${query}`;
    return h("a", { class: "t-button", href, download: "" }, format === "csv" ? "CSV" : "Parquet");
  });
  const { name } = satellites.get(satellite);
  return h("p", {}, `${name}, ${packet}: ${what} `, links);
}
