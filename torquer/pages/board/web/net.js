// Requests: mistakes come as errors with their keys; runs come as bytes.

export class Refused extends Error {
  constructor(errors) {
    super(errors.map((each) => each.text).join("\n"));
    this.errors = errors;
  }
}

async function asked(path, body, signal) {
  const answer = await fetch(`/api/${path}`, { method: "POST", body: JSON.stringify(body), signal });
  if (answer.ok) return answer;
  const text = await answer.text();
  let errors;
  try {
    ({ errors } = JSON.parse(text));
  } catch {
    /* said in plain text */
  }
  throw new Refused(errors ?? [{ key: "", text }]);
}

export const post = async (path, body, signal) => (await asked(path, body, signal)).json();

/** A run: `{header, arrays}`; each array is `{shape, values}`. */
export async function fly(data, signal) {
  const bytes = await (await asked("fly", { data }, signal)).arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  let at = Math.ceil((4 + length) / 8) * 8;
  const arrays = {};
  for (const [name, shape] of Object.entries(header.arrays)) {
    const count = shape.reduce((a, b) => a * b, 1);
    arrays[name] = { shape, values: new Float64Array(bytes, at, count) };
    at += 8 * count;
  }
  return { header, arrays };
}

/** Calls `show` with each line of an answer in lines of JSON. */
export async function lines(path, body, signal, show) {
  const reader = (await asked(path, body, signal)).body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const parts = (rest + value).split("\n");
    rest = parts.pop();
    for (const part of parts) show(JSON.parse(part));
  }
}

/**
 * The latest wins: one request in flight. What it is asked for meanwhile waits, the last one only;
 * a request that is superseded and takes longer than `patienceMs` is closed, which stops its work.
 */
export class Latest {
  #work;
  #patienceMs;
  #waits = null;
  #flight = null;
  counts = { begun: 0, closed: 0, most: 0, inFlight: 0 };

  constructor(work, patienceMs) {
    this.#work = work;
    this.#patienceMs = patienceMs;
  }

  ask(what) {
    this.#waits = { what };
    if (!this.#flight) return void this.#next();
    const { control, since } = this.#flight;
    const close = () => {
      if (!control.signal.aborted && this.#flight?.control === control && this.#waits) {
        this.counts.closed += 1;
        control.abort();
      }
    };
    setTimeout(close, Math.max(0, since + this.#patienceMs - performance.now()));
  }

  /** Closes what is in flight and forgets what waits. */
  stop() {
    this.#waits = null;
    this.#flight?.control.abort();
  }

  async #next() {
    while (this.#waits) {
      const { what } = this.#waits;
      this.#waits = null;
      const control = new AbortController();
      this.#flight = { control, since: performance.now() };
      this.counts.begun += 1;
      this.counts.inFlight += 1;
      this.counts.most = Math.max(this.counts.most, this.counts.inFlight);
      try {
        await this.#work(what, control.signal);
      } catch (error) {
        if (!control.signal.aborted) console.error(error);
      }
      this.counts.inFlight -= 1;
      this.#flight = null;
    }
  }
}
