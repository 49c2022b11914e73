// Limits: which value is beyond them, in the mode that the satellite is in.

/** Severities, the lesser first, with the signs that go with their words. */
export const SEVERITY_SIGNS = { warning: "▲", alarm: "◆" };

/**
 * Whether a value is out of limits: null, or its `severity`, `words`, and the `side` of a range.
 * `modes`: the number of each mode, by its key, as a Map has them.
 */
export function judge(one, value, modes) {
  if (!one.limits || value === null || value === undefined) return null;
  const { limits, critical, values } = limitsIn(one.limits, modes);
  if (typeof value === "number")
    for (const [severity, ends] of [
      ["alarm", critical],
      ["warning", limits],
    ]) {
      if (ends && value > ends[1]) return { severity, side: "upper", words: `above ${ends[1]}` };
      if (ends && value < ends[0]) return { severity, side: "lower", words: `below ${ends[0]}` };
    }
  const found = namesOf(one, value).filter((name) => values[name] ?? values[anyOf(one)]);
  if (!found.length) return null;
  const isAlarm = found.some((name) => (values[name] ?? values[anyOf(one)]) === "alarm");
  return { severity: isAlarm ? "alarm" : "warning", side: null, words: found.join(", ") };
}

/** The limits that apply. */
function limitsIn({ by_mode: byMode, ...own }, modes) {
  return byMode.find(({ mode, numbers }) => numbers.includes(modes.get(mode))) ?? own;
}

/** In the values that are alarms, a name for whichever bit is set. */
const anyOf = ({ bits }) => (bits ? "any" : undefined);

/** The label of a value, or the names of the bits that are set. */
function namesOf({ labels, bits }, value) {
  if (labels) return labels.has(value) ? [labels.get(value)] : [];
  if (!bits) return [];
  const set = [];
  for (let rest = value, place = 0; rest >= 1; rest = Math.floor(rest / 2), place += 1)
    if (rest % 2) set.push(bits[place] ?? String(place));
  return set;
}

/** Own limits of a number in a line. */
export function limitsInWords({ limits: stated }) {
  if (!stated) return "";
  const { limits, critical, values, by_mode: byMode } = stated;
  const range = ([low, high]) => `${low} to ${high}`;
  return [
    limits ? range(limits) : null,
    critical ? `alarm beyond ${range(critical)}` : null,
    ...Object.entries(values).map(([name, severity]) => `${severity}: ${name}`),
    byMode.length ? "others by mode" : null,
  ]
    .filter(Boolean)
    .join("; ");
}

/** Keeps `modes` of each satellite: the numbers of modes on which limits depend. */
export function followModes(satellites, rows) {
  const { signal } = new AbortController();
  for (const satellite of satellites.values()) {
    const all = Object.values(satellite.limits).flatMap(({ by_mode }) => by_mode);
    const keys = new Set(all.map(({ mode }) => mode));
    for (const name of new Set([...keys].map((key) => key.split(".")[0]))) {
      const packet = satellite.packets.get(name);
      const take = ({ values, quality }) => {
        if (quality === 0) return;
        for (const [number, place] of packet.places)
          if (keys.has(`${name}.${number}`)) satellite.modes.set(`${name}.${number}`, values[place]);
      };
      rows.follow(satellite.key, name, take, signal).catch(console.warn);
    }
  }
}
