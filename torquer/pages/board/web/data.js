// The scenario's data: values at dotted keys, its history for undo, and its place in the address.

const parts = (key) => key.split(".").filter(Boolean);

export function valueAt(data, key) {
  return parts(key).reduce((table, part) => table?.[part], data);
}

/** A copy of the data with a value at a key; `undefined` takes the key out. */
export function withValue(data, key, value) {
  const copy = structuredClone(data);
  const names = parts(key);
  const last = names.pop();
  let table = copy;
  for (const name of names) {
    if (typeof table[name] !== "object" || table[name] === null) table[name] = {};
    table = table[name];
  }
  if (value === undefined) delete table[last];
  else table[last] = value;
  return copy;
}

const MOST = 200;
/** Changes of one key within this time are one step [ms]. */
const ONE_STEP_MS = 800;

export class History {
  #past = [];
  #future = [];
  #last = { key: null, at: 0 };

  constructor(data) {
    this.now = data;
  }

  put(data, key) {
    const at = performance.now();
    const isSame = key !== null && key === this.#last.key && at - this.#last.at < ONE_STEP_MS;
    if (!isSame) this.#past.push(this.now);
    if (this.#past.length > MOST) this.#past.shift();
    this.#last = { key, at };
    this.#future = [];
    this.now = data;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  undo() {
    if (!this.canUndo) return;
    this.#future.push(this.now);
    this.now = this.#past.pop();
    this.#last = { key: null, at: 0 };
  }

  redo() {
    if (!this.canRedo) return;
    this.#past.push(this.now);
    this.now = this.#future.pop();
    this.#last = { key: null, at: 0 };
  }
}

async function through(stream, bytes) {
  const piped = new Blob([bytes]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(piped).arrayBuffer());
}

/** The data as the part of an address after `#`. */
export async function toAddress(data) {
  const bytes = await through(
    new CompressionStream("deflate-raw"),
    new TextEncoder().encode(JSON.stringify(data)),
  );
  const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  return `#s=${text.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
}

/** The data of an address; null where there is none, or none that can be read. */
export async function fromAddress(hash) {
  const text = new URLSearchParams(hash.slice(1)).get("s");
  if (!text) return null;
  try {
    const binary = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(binary, (character) => character.charCodeAt(0));
    const json = await through(new DecompressionStream("deflate-raw"), bytes);
    return JSON.parse(new TextDecoder().decode(json));
  } catch {
    return null;
  }
}
