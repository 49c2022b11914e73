// What the server tells of its satellites, with packets and numbers to be found by name.

/** Longest group of numbers that is a vector; longer ones are lists (states, bytes). */
const LONGEST_VECTOR = 4;

/** Map of satellites by key. */
export function satellitesOf(described) {
  const names = described.map(({ name }) => name);
  const isShared = (name) => names.indexOf(name) !== names.lastIndexOf(name);
  const named = ({ key, name }) => (isShared(name) ? `${name} (${key})` : name);
  return new Map(described.map((one) => [one.key, satellite({ ...one, name: named(one) })]));
}

function satellite({ key, name, clock_ms, has, packets, limits }) {
  const found = packets.map((packet) => [packet.key, packetOf(packet, limits)]);
  return { key, name, clock_ms, has, packets: new Map(found), limits, modes: new Map() };
}

function packetOf({ key, name, description, measurements }, limits) {
  const numbers = measurements.map((one) => numberOf(one, key, limits[one.key]));
  const places = new Map(numbers.map((one, i) => [one.key, i]));
  return { key, name, description, numbers, places, vectors: vectorsOf(numbers) };
}

/** `key`: as the archive has it; `name`: as it is shown. */
function numberOf({ key, name, description, values }, packet, limits) {
  const value = values.find(({ key }) => key === "value");
  const { unit = "", format, enumerations, bits } = value;
  const labels = enumerations && new Map(enumerations.map((one) => [one.value, one.string]));
  const shown = { name, description, unit, format, enumerations, bits };
  return { key: key.slice(packet.length + 1), labels, limits, ...shown };
}

/** Fields of several numbers (`omega_x`, `omega_y`, `omega_z`), by the name they share. */
function vectorsOf(numbers) {
  const groups = new Map();
  for (const one of numbers) {
    const base = one.key.match(/^(.+)_(?:[xyz]|\d+)$/)?.[1];
    const isNumber = one.format !== "enum" && !one.bits;
    if (base && isNumber) groups.set(base, [...(groups.get(base) ?? []), one]);
  }
  const isVector = ([, group]) =>
    group.length > 1 &&
    group.length <= LONGEST_VECTOR &&
    group.every(({ description }) => description === group[0].description);
  return new Map([...groups].filter(isVector));
}

/** The values of a row by a vector's name; null where one is unknown or infinite. */
export function vector(packet, row, base) {
  const keys = packet.vectors.get(base)?.map(({ key }) => key) ?? [];
  const values = keys.map((key) => row.values[packet.places.get(key)]);
  const isKnown = values.length > 0 && values.every(Number.isFinite);
  return isKnown ? values : null;
}
