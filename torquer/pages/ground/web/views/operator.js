// The name that is stated with orders: a field, or why there is nothing to order.

import { h } from "../dom.js";
import { LONGEST_NAME, mayCommand, ONLY_WATCHES, operator, setOperator } from "../net/role.js";

/** A line for views with buttons that change something. */
export function operatorLine() {
  if (!mayCommand()) return h("p", { class: "t-watches", role: "note" }, ONLY_WATCHES);
  const input = h("input", {
    type: "text",
    value: operator(),
    maxLength: LONGEST_NAME,
    placeholder: "not stated",
    autocomplete: "off",
    name: "operator",
    onchange: () => setOperator(input.value.trim()),
  });
  return h(
    "div",
    { class: "t-bar t-operator" },
    h("label", {}, "Your name ", input),
    h("span", { class: "t-note" }, "stated with each order, not proved"),
  );
}

/** A button that changes something: disabled, with the reason, for those who only watch. */
export function orderButton(text, onclick, properties = {}) {
  const watches = mayCommand() ? {} : { disabled: true, title: ONLY_WATCHES };
  const own = { type: "button", class: "t-button", onclick };
  return h("button", { ...own, ...properties, ...watches }, text);
}
