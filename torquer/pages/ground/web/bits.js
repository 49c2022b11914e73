// Numbers of which each bit has a meaning, in words.

/** Names of the bits that are set, the number beside; a bit without a name goes by its place. */
export function bitsInWords(names, value) {
  const set = [];
  // No bit operations: they would take the highest bit for a sign.
  for (let rest = value, place = 0; rest >= 1; rest = Math.floor(rest / 2), place += 1)
    if (rest % 2) set.push(names[place] ?? String(place));
  return `${set.join(", ") || "none"} (${value})`;
}

/** Key of the format in which Open MCT shows such a number. */
export const bitsFormat = (names) => `bits ${names.join(",")}`;
