// A satellite's clock against that of the ground: its difference, and how fast it goes.

/** Packets that tell of earlier times. */
const RECORDED = new Set(["stored", "dump"]);
/** Time over which the pace is measured, and of which it is taken anew [ms]. */
const PACED_MS = 3000;
const WINDOW_MS = 20_000;
/** From here on a clock is not a little wrong, but of another epoch [ms]. */
export const EPOCH_MS = 86_400_000;
/** A pace within these is real time. */
const REAL_TIME = [0.5, 1.5];

/** Watches the rows of a satellite; both are null until they are known. */
export class SatelliteClock {
  /** On-board time less time of reception [ms], of the newest row. */
  difference = null;
  /** Seconds on board in a second of the ground. */
  pace = null;
  #begun = null;

  constructor(satellite, rows, signal = undefined) {
    const take = (received) => {
      for (const row of received) if (row.satellite === satellite.key) this.#take(row);
    };
    rows.first(take, signal);
  }

  /** Whether the satellite is simulated at another pace, as far as can be seen. */
  get isPaced() {
    return this.pace !== null && (this.pace < REAL_TIME[0] || this.pace > REAL_TIME[1]);
  }

  #take({ packet, time, received, quality }) {
    if (RECORDED.has(packet) || quality === 0 || received === null) return;
    this.difference = time - received;
    const begun = this.#begun;
    if (!begun || time < begun.time) this.#begun = { time, received };
    else if (received - begun.received >= PACED_MS) {
      this.pace = (time - begun.time) / (received - begun.received);
      if (received - begun.received > WINDOW_MS) this.#begun = { time, received };
    }
  }
}
