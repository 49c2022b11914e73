// Telemetry for Open MCT: history by requests, live rows, limits.

import { frames, history } from "../net/rows.js";
import { judge } from "../limits.js";
import { TYPES } from "./objects.js";
import { isPlace, oneOfEachRun, withOrigin } from "./places.js";

/** Most rows of a request that is not thinned, for tables. */
const MOST_ROWS = 10_000;

/** A row that may be damaged. */
const SUSPECT = 0;
const IS_SUSPECT = { cssClass: "is-limit--yellow", name: "suspect" };

const isNumber = ({ type }) => type === TYPES.number;
const isPacket = ({ type }) => type === TYPES.packet;
const isOurs = (object) => isNumber(object) || isPacket(object);

export class Telemetry {
  #openmct;
  #satellites;
  #rows;
  #latency;

  /** `latency`: called with every row that was handed over, or null. */
  constructor(openmct, satellites, rows, latency) {
    this.#openmct = openmct;
    this.#satellites = satellites;
    this.#rows = rows;
    this.#latency = latency;
  }

  install() {
    this.#openmct.telemetry.addProvider({
      supportsRequest: isOurs,
      request: (object, options) => this.#request(object, options),
      supportsSubscribe: isOurs,
      subscribe: (object, callback) => this.#subscribe(object, callback),
      supportsLimits: (object) => isOurs(object),
      getLimitEvaluator: (object) => this.#evaluator(object),
      getLimits: (object) => ({ limits: async () => this.#limitLines(object) }),
    });
  }

  async #request(object, options) {
    const parameters = parametersOf(options);
    const { satellite, packet, number } = object;
    if (isPacket(object)) {
      const { numbers } = this.#packet(satellite, packet);
      const rows = await frames(satellite, packet, parameters, options.signal);
      return rows.map((row) => frameDatum(row, numbers));
    }
    const points = await history(satellite, packet, number, parameters, options.signal);
    const isPlot = options.strategy === "minmax";
    const rows = isPlot ? withOrigin(oneOfEachRun(points), options) : points;
    return rows.map(([time, received, value, quality]) => numberDatum({ time, received, quality }, value));
  }

  #subscribe(object, callback) {
    const { satellite, packet, number } = object;
    const { places, numbers } = this.#packet(satellite, packet);
    const place = places.get(number);
    const stop = new AbortController();
    let last;
    const hand = (row) => {
      if (this.#isBehindFixedSpan(row)) return;
      const value = row.values[place];
      if (isNumber(object) && !isPlace(value) && last !== undefined && !isPlace(last)) return;
      last = value;
      callback(isNumber(object) ? numberDatum(row, value) : frameDatum(row, numbers));
      this.#latency?.(row.received);
    };
    this.#rows.listen(satellite, packet, hand, stop.signal);
    return () => stop.abort();
  }

  /** With a fixed time span Open MCT would keep all later rows, for a clock that does not tick. */
  #isBehindFixedSpan(row) {
    const { time } = this.#openmct;
    const others = [...time.independentContexts.values()];
    const isLive = (context) => context.hasOwnContext() && context.isRealTime();
    if (!time.isFixed() || others.some(isLive)) return false;
    const at = time.getTimeSystem().key === "received" ? row.received : row.time;
    return at > time.getBounds().end;
  }

  #evaluator(object) {
    const { places, numbers } = this.#packet(object.satellite, object.packet);
    const { modes } = this.#satellites.get(object.satellite);
    return {
      evaluate: (datum, valueMetadata) => {
        const key = valueMetadata?.key ?? "value";
        if (key === "quality") return datum.quality === SUSPECT ? IS_SUSPECT : undefined;
        const number = isNumber(object) && key === "value" ? object.number : key;
        const one = numbers[places.get(number)];
        return one ? limitState(one, datum[key], modesAt(object, datum, modes)) : undefined;
      },
    };
  }

  #limitLines(object) {
    const { places, numbers } = this.#packet(object.satellite, object.packet);
    const limits = numbers[places.get(object.number)]?.limits;
    const levels = { WARNING: [limits?.limits, "yellow"], CRITICAL: [limits?.critical, "red"] };
    const stated = Object.entries(levels).filter(([, [ends]]) => ends);
    const line = (value, color) => ({ color, value });
    const linesOf = ([low, high], color) => ({ low: line(low, color), high: line(high, color) });
    if (!stated.length) return undefined;
    return Object.fromEntries(stated.map(([level, [ends, color]]) => [level, linesOf(ends, color)]));
  }

  #packet(satellite, packet) {
    return this.#satellites.get(satellite).packets.get(packet);
  }
}

/** Plots may be thinned; tables get the last rows as they are. */
function parametersOf({ start, end, domain, strategy, size }) {
  const span = { start: Math.floor(start), end: Math.ceil(end) };
  const by = domain === "received" ? "received" : "time";
  if (strategy === "minmax") return { ...span, by, size: size ?? 1000 };
  const rows = strategy === "latest" ? (size ?? 1) : (size ?? MOST_ROWS);
  return { ...span, by, latest: 1, size: Math.min(rows, MOST_ROWS) };
}

/** Unknown numbers are left out: Open MCT would draw null as zero. */
const datum = ({ time, received, quality }) => ({
  utc: time,
  received: received ?? undefined,
  quality,
});
const numberDatum = (row, value) => ({ ...datum(row), value: value ?? undefined });

function frameDatum(row, numbers) {
  const values = numbers.map(({ key }, i) => [key, row.values[i] ?? undefined]);
  return { ...datum(row), ...Object.fromEntries(values) };
}

/** The modes of a row's time where its packet tells them, else the present ones. */
const modesAt = ({ packet }, row, modes) => ({
  get: (key) => (isPacketOf(packet, key) ? row[key.slice(packet.length + 1)] : null) ?? modes.get(key),
});
const isPacketOf = (packet, key) => key.startsWith(`${packet}.`);

function limitState(one, value, modes) {
  const found = judge(one, value, modes);
  if (!found) return undefined;
  const side = found.side && `is-limit--${found.side === "upper" ? "upr" : "lwr"}`;
  const colour = `is-limit--${found.severity === "alarm" ? "red" : "yellow"}`;
  return { cssClass: side ? `${side} ${colour}` : colour, name: found.words };
}
