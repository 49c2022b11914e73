// Objects that compare satellites: the view side by side, and plots of the same number.

const KEY = "satellites";
const COLOURS = ["#4dabf7", "#ffa94d", "#51cf66", "#e599f7", "#ffd43b", "#ff6b6b"];

/**
 * Objects `[parent, key, content]` of what at least two satellites have; `numberKey`: of a number's
 * object; `types`: of the objects; `identifier`: of a key.
 */
export function comparison(satellites, { numberKey, types, identifier, namespace }) {
  if (satellites.size < 2) return [];
  const found = [];
  const folders = [];
  const plots = [];
  const packets = new Set([...satellites.values()].flatMap(({ packets }) => [...packets.keys()]));
  for (const packet of packets) {
    const folder = `${KEY}.${packet}`;
    const keys = [];
    for (const [name, members] of sharedNumbers(satellites, packet)) {
      const key = `${folder}.${name}`;
      const path = [KEY, folder, key].map((one) => `${namespace}:${one}`).join("/");
      keys.push(key);
      plots.push({ path: `#/browse/${path}`, name: `${packet}: ${name}` });
      found.push([folder, key, plotOf(name, members, numberKey, identifier)]);
    }
    if (!keys.length) continue;
    folders.push(folder);
    found.push([KEY, folder, { name: packet, type: "folder", composition: keys.map(identifier) }]);
  }
  const composition = folders.map(identifier);
  const content = { name: "Satellites", type: types.satellites, plots, composition };
  return [[null, KEY, content], ...found];
}

/** Numbers of a packet that several satellites have in the same unit: `[name, members]`. */
function sharedNumbers(satellites, packetName) {
  const byName = new Map();
  for (const satellite of satellites.values()) {
    const packet = satellite.packets.get(packetName);
    for (const one of packet?.numbers ?? []) {
      if (one.format === "string") continue;
      const key = `${one.key} ${one.unit}`;
      byName.set(key, [...(byName.get(key) ?? []), { satellite, packet, one }]);
    }
  }
  return [...byName.values()]
    .filter((members) => members.length > 1)
    .map((members) => [members[0].one.key, members]);
}

function plotOf(name, members, numberKey, identifier) {
  const keys = members.map(({ satellite, packet, one }) => numberKey(satellite, packet, one));
  const { unit, description } = members[0].one;
  const series = keys.map((key, i) => ({
    identifier: identifier(key),
    color: COLOURS[i % COLOURS.length],
    name: members[i].satellite.name,
  }));
  return {
    name: `${name}: ${members.map(({ satellite }) => satellite.name).join(", ")}`,
    notes: description,
    type: "telemetry.plot.overlay",
    composition: keys.map(identifier),
    configuration: { series, yAxis: { label: unit || name } },
  };
}
