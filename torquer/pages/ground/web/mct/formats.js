// How numbers of telemetry are written and read.

import { number } from "../dom.js";

const parse = (text) => (text === null || text === undefined ? NaN : Number(text));

export function installFormats(openmct) {
  const written = { format: number, parse, validate: (text) => !Number.isNaN(parse(text)) };
  openmct.telemetry.addFormat({ key: "float", ...written });
  openmct.telemetry.addFormat({ key: "integer", ...written });
}
