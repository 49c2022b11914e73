// Requests to the server; all of them go to the page's own origin.

/** Where the browser keeps the name that the user states. */
export const OPERATOR = "torquer.operator";

/** Refusal by the server, with its reason in one line. */
export class ServerError extends Error {}

/** Path of a satellite's route. */
export const route = (satellite, ...parts) =>
  ["/api", satellite, ...parts].map((part, i) => (i ? encodeURIComponent(part) : part)).join("/");

export async function get(path, parameters = {}, signal = undefined) {
  const given = Object.entries(parameters).filter(([, value]) => value !== undefined);
  const query = new URLSearchParams(given).toString();
  return answer(await fetch(query ? `${path}?${query}` : path, { signal }));
}

/** A request that changes something, with the name that the user states. */
export async function post(path, body, method = "POST") {
  const headers = { "Content-Type": "application/json" };
  const stated = localStorage.getItem(OPERATOR);
  // Headers are of ASCII only.
  if (stated) headers["Torquer-Operator"] = encodeURIComponent(stated);
  return answer(await fetch(path, { method, headers, body: JSON.stringify(body) }));
}

/** Whether the server knows this page; null where none answers. */
export async function isKnownHere() {
  const response = await fetch("/api/role").catch(() => null);
  return response && !isStranger(response);
}

/** For requests that nobody waits for: when `signal` says that a view is closed, they may fail. */
export function inBackground(request, signal) {
  request.catch((error) => signal.aborted || console.warn(error));
}

async function answer(response) {
  if (response.ok) return response.json();
  const found = await response.json().catch(() => ({}));
  throw new ServerError(found.error ?? meaning(response));
}

const isStranger = ({ status }) => status === 401 || status === 403;

function meaning(response) {
  if (isStranger(response))
    return "The server does not know this page. Open the address that it printed at its start.";
  return `The server answered ${response.status} ${response.statusText}`.trim();
}
