// The tree of objects: satellites, their views, packets, numbers, and plots of vectors.

import { bitsFormat } from "../bits.js";
import { QUALITIES } from "../net/rows.js";
import { comparison } from "./comparison.js";

export const NAMESPACE = "torquer";
export const TYPES = {
  overview: "flexible-layout",
  attitude: "torquer.attitude",
  modes: "torquer.modes",
  commands: "torquer.commands",
  stack: "torquer.stack",
  plan: "torquer.plan",
  history: "torquer.history",
  log: "torquer.log",
  past: "torquer.past",
  gaps: "torquer.gaps",
  satellites: "torquer.satellites",
  alarms: "torquer.alarms",
  passes: "torquer.passes",
  state: "torquer.state",
  packet: "torquer.packet",
  number: "torquer.number",
};

/** Colours of the components of a vector: x, y, z as in the 3D view, then the scalar. */
export const AXIS_COLOURS = ["#ff6b6b", "#51cf66", "#4dabf7", "#ffd43b"];

/** Vectors that the overview plots where a packet has them, the most wanted first. */
const IN_OVERVIEW = ["omega", "q_orbital", "b", "dipole"];
const MOST_PLOTS = 3;

const TIMES = [
  { key: "utc", source: "utc", name: "On-board time", format: "utc", hints: { domain: 1 } },
  { key: "received", source: "received", name: "Received", format: "utc", hints: { domain: 2 } },
];

const identifier = (key) => ({ namespace: NAMESPACE, key });

/** All objects by key; satellites are the roots. */
class Objects {
  #objects = new Map();

  constructor(satellites) {
    for (const satellite of satellites.values()) this.#addSatellite(satellite);
    const how = { numberKey, types: TYPES, identifier, namespace: NAMESPACE };
    for (const one of comparison(satellites, how)) this.#add(...one);
    this.#add(null, ALARMS, { name: "All alarms", type: TYPES.alarms });
  }

  get(key) {
    return this.#objects.get(key);
  }

  /** Keys of the objects at the top of the tree. */
  get roots() {
    return [...this.#objects].filter(([, { location }]) => location === "ROOT").map(([key]) => key);
  }

  #add(parent, key, content) {
    const location = parent === null ? "ROOT" : `${NAMESPACE}:${parent}`;
    // Locked: what the dictionary tells is not edited here; a copy can be.
    this.#objects.set(key, { identifier: identifier(key), location, locked: true, ...content });
    return key;
  }

  #addSatellite(satellite) {
    const { key, name } = satellite;
    const children = [...this.#views(satellite), this.#packets(satellite)];
    this.#add(null, key, {
      name,
      type: "folder",
      satellite: key,
      composition: children.map(identifier),
    });
  }

  #views(satellite) {
    const { key, has } = satellite;
    const view = (type, name) =>
      this.#add(key, `${key}.view.${type}`, { name, type: TYPES[type], satellite: key });
    view("state", "State");
    return [
      this.#overview(satellite),
      view("attitude", "Attitude 3D"),
      has.modes ? view("modes", "Modes") : null,
      view("commands", "Commands"),
      view("stack", "Command stack"),
      has.plan ? view("plan", "Plan") : null,
      view("history", "Command history"),
      view("log", "Log"),
      view("past", "Past"),
      view("gaps", "Gaps"),
      view("alarms", "Alarms"),
      has.passes ? view("passes", "Passes") : null,
    ].filter(Boolean);
  }

  #overview(satellite) {
    const { key } = satellite;
    const columns = [
      column(34, [`${key}.view.state`]),
      column(66, [...plotsOfOverview(satellite), `${key}.view.log`]),
    ];
    return this.#add(key, `${key}.view.overview`, {
      name: "Overview",
      type: TYPES.overview,
      satellite: key,
      configuration: { containers: columns, rowsLayout: false },
      composition: columns.flatMap(({ frames }) => frames.map((one) => one.domainObjectIdentifier)),
    });
  }

  #packets(satellite) {
    const key = `${satellite.key}.packets`;
    const children = [...satellite.packets.values()].map((packet) =>
      this.#packet(satellite, packet, key),
    );
    const composition = children.map(identifier);
    const content = { name: "Packets", type: "folder", satellite: satellite.key, composition };
    return this.#add(satellite.key, key, content);
  }

  #packet(satellite, packet, parent) {
    const key = packetKey(satellite, packet);
    const of = { satellite: satellite.key, packet: packet.key };
    const vectors = [...packet.vectors.keys()].map((base) =>
      this.#plot(satellite, packet, base, key),
    );
    const numbers = packet.numbers.map((one) => this.#number(satellite, packet, one, key));
    return this.#add(parent, key, {
      name: packet.name,
      notes: packet.description,
      type: TYPES.packet,
      ...of,
      telemetry: { values: [...TIMES, qualityColumn(), ...packet.numbers.map(columnOfPacket)] },
      configuration: tableOf(
        packet.numbers.map((one) => one.key),
        packet.numbers.filter(({ bits }) => bits).map((one) => one.key),
      ),
      composition: [...vectors, ...numbers].map(identifier),
    });
  }

  #number(satellite, packet, one, parent) {
    const key = numberKey(satellite, packet, one);
    const of = { satellite: satellite.key, packet: packet.key, number: one.key };
    const unit = one.unit || undefined;
    const value = { ...columnOf(one, 0), key: "value", source: "value", unit };
    return this.#add(parent, key, {
      name: one.name,
      notes: one.description,
      type: TYPES.number,
      ...of,
      telemetry: { values: [...TIMES, qualityColumn(), value, ...namesColumns(one)] },
      configuration: { ...tableOf(["value"], ["names"]), series: [series(key, one, 2)] },
    });
  }

  #plot(satellite, packet, base, parent) {
    const members = packet.vectors.get(base);
    const keys = members.map((one) => numberKey(satellite, packet, one));
    return this.#add(parent, plotKey(satellite, packet, base), {
      name: base,
      notes: members[0].description,
      type: "telemetry.plot.overlay",
      satellite: satellite.key,
      composition: keys.map(identifier),
      configuration: {
        // Markers take more than ten times as long to draw as lines.
        series: keys.map((key, i) => ({ ...series(key, members[i], i), markers: false })),
        yAxis: { label: members[0].unit || base },
      },
    });
  }
}

const packetKey = (satellite, packet) => `${satellite.key}.packet.${packet.key}`;
const numberKey = (satellite, packet, { key }) => `${packetKey(satellite, packet)}.${key}`;
const plotKey = (satellite, packet, base) => `${satellite.key}.plot.${packet.key}.${base}`;

/** A number's column in tables, and its axis in plots. */
function columnOf({ key, name, format, enumerations }, place) {
  const shown = enumerations ? { format: "enum", enumerations: [...enumerations] } : { format };
  return { key, source: key, name, ...shown, hints: { range: place + 1 } };
}

/** The same with the unit in its title: a packet's table would have a column for each unit. */
const columnOfPacket = (one, place) => ({
  ...columnOf(one, place),
  ...(one.bits ? { format: bitsFormat(one.bits) } : {}),
  name: titleOf(one),
});

/** Names of the bits that are set, beside a number that is plotted: an axis has no room for them. */
const namesColumns = ({ bits }) =>
  bits ? [{ key: "names", source: "value", name: "Set", format: bitsFormat(bits) }] : [];

const titleOf = ({ name, unit }) => (unit ? `${name} [${unit}]` : name);

/** How the telemetry table shows the columns: no name in every row, times in full. */
function tableOf(keys, wideKeys) {
  const widths = [...keys, "quality"].map((key) => [key, 130]);
  for (const key of wideKeys) widths.push([key, 260]);
  return {
    hiddenColumns: { name: true },
    columnWidths: { utc: 175, received: 175, ...Object.fromEntries(widths) },
    autosize: false,
  };
}

function qualityColumn() {
  const enumerations = QUALITIES.map((string, value) => ({ value, string }));
  return { key: "quality", source: "quality", name: "Quality", format: "enum", enumerations };
}

/** How a plot draws a number; limits that several numbers share are drawn once. */
function series(key, { limits }, place) {
  const color = AXIS_COLOURS[place];
  const hasLines = Boolean(limits?.limits || limits?.critical);
  return { identifier: identifier(key), color, limitLines: hasLines && place % 3 === 0 };
}

function plotsOfOverview(satellite) {
  const found = [];
  for (const base of IN_OVERVIEW)
    for (const packet of satellite.packets.values())
      if (packet.vectors.has(base) && found.length < MOST_PLOTS && !isReplay(packet))
        found.push(plotKey(satellite, packet, base));
  return found;
}

/** Packets that repeat what was stored on board are not what happens now. */
const isReplay = ({ key }) => key === "stored";

function column(size, keys) {
  const share = 100 / keys.length;
  const frames = keys.map((key) => ({
    id: `frame.${key}`,
    domainObjectIdentifier: identifier(key),
    size: share,
    noFrame: false,
  }));
  return { id: `column.${keys[0]}`, size, frames };
}

/** Address of the overview of a satellite within the page. */
export const overviewPath = (satellite) =>
  `#/browse/${NAMESPACE}:${satellite.key}/${NAMESPACE}:${satellite.key}.view.overview`;

/** The alarms of all satellites, and their address within the page. */
const ALARMS = "alarms";
export const ALARMS_PATH = `#/browse/${NAMESPACE}:${ALARMS}?hideInspector=true`;

/** Types of objects with names and icons of their own. */
const KINDS = {
  [TYPES.attitude]: ["Attitude 3D", "icon-object"],
  [TYPES.modes]: ["Modes", "icon-layers"],
  [TYPES.commands]: ["Commands", "icon-play"],
  [TYPES.stack]: ["Command stack", "icon-list-view"],
  [TYPES.plan]: ["Plan", "icon-timeline"],
  [TYPES.history]: ["Command history", "icon-history"],
  [TYPES.log]: ["Log", "icon-notebook"],
  [TYPES.past]: ["Past", "icon-clock"],
  [TYPES.gaps]: ["Gaps", "icon-brackets"],
  [TYPES.satellites]: ["Satellites", "icon-layout"],
  [TYPES.alarms]: ["Alarms", "icon-bell"],
  [TYPES.passes]: ["Passes", "icon-map"],
  [TYPES.state]: ["State", "icon-info"],
  [TYPES.packet]: ["Packet", "icon-database"],
  [TYPES.number]: ["Number", "icon-telemetry"],
};

export function installObjects(openmct, satellites) {
  const objects = new Objects(satellites);
  for (const [type, [name, cssClass]] of Object.entries(KINDS))
    openmct.types.addType(type, { name, cssClass, creatable: false });
  openmct.objects.addProvider(NAMESPACE, { get: async ({ key }) => objects.get(key) });
  for (const key of objects.roots) openmct.objects.addRoot(identifier(key), openmct.priority.HIGH);
}
