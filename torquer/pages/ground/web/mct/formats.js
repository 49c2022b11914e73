// How numbers of telemetry are written and read.

import { bitsFormat, bitsInWords } from "../bits.js";
import { number } from "../dom.js";

const parse = (text) => (text === null || text === undefined ? NaN : Number(text));

export function installFormats(openmct, satellites) {
  const written = { format: number, parse, validate: (text) => !Number.isNaN(parse(text)) };
  openmct.telemetry.addFormat({ key: "float", ...written });
  openmct.telemetry.addFormat({ key: "integer", ...written });
  for (const bits of bitsOf(satellites)) {
    const format = (value) => (Number.isInteger(value) ? bitsInWords(bits, value) : number(value));
    openmct.telemetry.addFormat({ ...written, key: bitsFormat(bits), format });
  }
}

/** Names of bits, as often as numbers have them. */
function bitsOf(satellites) {
  const packets = [...satellites.values()].flatMap((one) => [...one.packets.values()]);
  const numbers = packets.flatMap((packet) => packet.numbers);
  return numbers.map(({ bits }) => bits).filter(Boolean);
}
