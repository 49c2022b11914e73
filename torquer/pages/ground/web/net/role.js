// Who uses this page: the role that its address gives, and the name that the user states.

import { get, OPERATOR } from "./api.js";

/** Longest name, as the server has it. */
export const LONGEST_NAME = 40;
/** What those who only watch are told. */
export const ONLY_WATCHES =
  "This page may only watch. The first address that torquer ground printed may command.";

let role = "command";

export async function askRole() {
  role = (await get("/api/role")).role;
}

export const mayCommand = () => role === "command";

/** The name that is stated with orders, kept by the browser; "" for none. */
export const operator = () => localStorage.getItem(OPERATOR) ?? "";

export function setOperator(name) {
  if (name) localStorage.setItem(OPERATOR, name);
  else localStorage.removeItem(OPERATOR);
}
