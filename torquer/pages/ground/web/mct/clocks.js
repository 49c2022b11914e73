// Time: the satellites' on-board clocks and the time of reception, for the time conductor.

/** A clock that has not gone on for so long follows what comes, even backwards [ms]. */
const STUCK_MS = 10_000;
const MINUTE_MS = 60_000;

const clockKey = (satellite) => `onboard.${satellite.key}`;

/**
 * Goes on with the newest on-board time of a satellite. Older rows (replays) do not turn it back,
 * unless nothing newer comes for a while: then the satellite's clock was set back, or a damaged
 * frame had set ours forward.
 */
class OnBoardClock {
  cssClass = "icon-clock";
  #listeners = new Set();
  #isHeard;
  #time;
  #lastForward = performance.now();

  constructor(satellite) {
    this.key = clockKey(satellite);
    this.name = `Clock of ${satellite.name}`;
    this.description = "The newest on-board time that telemetry has brought.";
    this.#isHeard = Boolean(satellite.clock_ms);
    this.#time = satellite.clock_ms ?? Date.now();
  }

  currentValue() {
    return this.#time;
  }

  /** The time, or null until one is heard: the clock shows this computer's till then. */
  get heard() {
    return this.#isHeard ? this.#time : null;
  }

  on(event, listener, context = undefined) {
    this.#listeners.add({ event, listener, context });
    return this;
  }

  off(event, listener) {
    for (const one of this.#listeners) if (one.listener === listener) this.#listeners.delete(one);
    return this;
  }

  /** Goes on with rows; to be called before views see them, which hold back what is later. */
  advance(rows) {
    // The time in a suspect frame may be damaged.
    const times = rows.filter(({ quality }) => quality > 0).map(({ time }) => time);
    if (!times.length) return;
    const now = performance.now();
    const newest = Math.max(...times);
    const isStuck = now - this.#lastForward > STUCK_MS || !this.#isHeard;
    if (newest <= this.#time && !isStuck) return;
    this.#time = newest;
    this.#isHeard = true;
    this.#lastForward = now;
    for (const { listener, context } of this.#listeners) listener.call(context, this.#time);
  }
}

/** Time systems, clocks and the conductor; `rows` drive the clocks. */
export function installTime(openmct, satellites, rows) {
  openmct.install(openmct.plugins.UTCTimeSystem());
  const system = { timeFormat: "utc", durationFormat: "duration", isUTCBased: true };
  const cssClass = "icon-clock";
  openmct.time.addTimeSystem({ key: "utc", name: "On-board time", cssClass, ...system });
  openmct.time.addTimeSystem({ key: "received", name: "Time of reception", cssClass, ...system });
  const clocks = new Map([...satellites.values()].map((one) => [one.key, new OnBoardClock(one)]));
  clocks.forEach((clock) => openmct.time.addClock(clock));
  openmct.time.clocks.get("local").name = "Clock on the ground";
  rows.first((received) => {
    for (const [key, clock] of clocks)
      clock.advance(received.filter(({ satellite }) => satellite === key));
  });
  openmct.install(openmct.plugins.Conductor({ menuOptions: menuOptions([...clocks.values()]) }));
}

function menuOptions(clocks) {
  const clockOffsets = { start: -15 * MINUTE_MS, end: 0 };
  const now = Date.now();
  const newest = clocks[0]?.currentValue() ?? now;
  const lastHour = (end) => ({ start: end - 60 * MINUTE_MS, end });
  const live = (clock, timeSystem) => ({ name: "Live", timeSystem, clock, clockOffsets });
  const fixed = (timeSystem, end) => ({ name: "Fixed", timeSystem, bounds: lastHour(end) });
  return [
    ...clocks.map(({ key }) => live(key, "utc")),
    live("local", "received"),
    fixed("utc", newest),
    fixed("received", now),
  ];
}

/** Lets the conductor follow the clock of the satellite whose object is open. */
export function followOpenSatellite(openmct, satellites) {
  openmct.router.on("afterNavigation", () => {
    const key = openmct.router.path?.find((object) => object?.satellite)?.satellite;
    const active = openmct.time.getClock()?.key ?? "";
    if (!key || !openmct.time.isRealTime() || !active.startsWith("onboard.")) return;
    const wanted = clockKey(satellites.get(key));
    if (active !== wanted) openmct.time.setClock(wanted);
    if (active !== wanted) askAgain(openmct);
  });
}

/** Lets all views request their history again, with bounds of the clock. */
export function askAgain(openmct) {
  const { time } = openmct;
  if (time.isRealTime()) time.setClockOffsets(time.getClockOffsets());
  else time.setBounds(time.getBounds());
}
