// Elements, and the texts of numbers and times.

/** An element with properties (`class`, `data-…`, `on…` or its own) and children. */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in element) element[name] = value;
    else if (value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** Text of a time in milliseconds since 1970, UTC, to the second. */
export function utc(milliseconds) {
  if (milliseconds === null || milliseconds === undefined) return "";
  const date = new Date(milliseconds);
  if (Number.isNaN(date.getTime())) return "invalid time";
  return date.toISOString().slice(0, 19).replace("T", " ");
}

/** The same without the date where it is today's. */
export function utcToday(milliseconds) {
  const text = utc(milliseconds);
  const [day, time] = text.split(" ");
  return day === utc(Date.now()).slice(0, 10) ? time : text;
}

/** Text of a number: seven digits, large ones in full, because a time needs all of them. */
export function number(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "unknown";
  const digits = Math.abs(value) < 1e6 ? Number(Number(value).toPrecision(7)) : value;
  return String(digits);
}

/** Calls `work` once in the next frame however often it is asked for; stops with `signal`. */
export function oncePerFrame(work, signal) {
  let waits = false;
  return () => {
    if (waits) return;
    waits = true;
    requestAnimationFrame(() => {
      waits = false;
      if (!signal.aborted) work();
    });
  };
}

/** Calls `work` every `milliseconds` until `signal` says stop. */
export function every(milliseconds, work, signal) {
  const timer = setInterval(work, milliseconds);
  signal.addEventListener("abort", () => clearInterval(timer));
}
