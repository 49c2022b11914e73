// What a satellite's clock is to UTC, in words.

import { EPOCH_MS } from "./net/satellite_clock.js";
import { duration, inZone } from "./times.js";

/** A time on board, its difference to UTC, or another epoch, its pace where it is not real time. */
export const clockInWords = (time, clock) =>
  time === null
    ? "on-board time unknown"
    : [`${inZone(time)} on board`, ...about(clock)].join("; ");

function about({ difference, pace, isPaced }) {
  if (difference === null) return [];
  const signed = `${difference < 0 ? "−" : "+"}${duration(difference)}`;
  const isOther = Math.abs(difference) >= EPOCH_MS;
  const found = [isOther ? `another epoch: ${signed} to UTC` : `clock ${signed} to UTC`];
  if (isPaced) found.push(`simulated at ${pace < 10 ? pace.toFixed(1) : Math.round(pace)} × real time`);
  return found;
}
