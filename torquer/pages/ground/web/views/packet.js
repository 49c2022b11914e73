// The newest values of a whole packet.

import { h } from "../dom.js";
import { showValues } from "./values.js";

export function showPacket(element, context) {
  const packet = context.satellite.packets.get(context.object.packet);
  const box = h("div", { class: "t-scroll", tabindex: 0 }, h("p", { class: "t-note" }, packet.description));
  element.append(box);
  return showValues(box, context, packet, packet.numbers, true);
}
