// Measurement of the way from the server to the screen, with `?measure` in the address only.

const MOST = 2000;

/**
 * Told of each row handed to Open MCT by its time of reception, it notes in
 * `window.torquer.latency` how long after that the second frame began: by then the row is drawn
 * [ms].
 */
export function latencyMeter() {
  if (!new URLSearchParams(location.search).has("measure")) return null;
  const latency = [];
  window.torquer = { latency };
  const note = (received) => {
    latency.push(Date.now() - received);
    if (latency.length > MOST) latency.shift();
  };
  return (received) => {
    // A page that nobody sees has no frames: calls would pile up.
    if (document.hidden) return;
    requestAnimationFrame(() => requestAnimationFrame(() => note(received)));
  };
}
