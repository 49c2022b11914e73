// Places of plots: what Open MCT is handed of values that are not finite.

/** How far before a plot its origin is, in widths of the plot. */
const AWAY = 100;

/**
 * Plots count from their first value: nothing would be seen if that were not finite. Then they get
 * a point far outside, from which no line leads to what is not finite.
 */
export function withOrigin(points, { start, end }) {
  if (!points.length || isPlace(points[0][2])) return points;
  const first = points.find(([, , value]) => isPlace(value));
  const shift = AWAY * (end - start);
  const origin = points[0].map((one, i) => (i < 2 && one !== null ? Math.floor(one - shift) : one));
  origin[2] = first ? first[2] : 0;
  return [origin, ...points];
}

/** Whether a plot has a place for a value. */
export const isPlace = (value) => value !== null && Math.abs(value) !== Infinity;

/** Of places side by side that are not finite plots keep one: an infinity rather than a gap. */
export function oneOfEachRun(points) {
  const kept = [];
  for (const point of points) {
    const last = kept.at(-1);
    if (!last || isPlace(point[2]) || isPlace(last[2])) kept.push(point);
    else if (last[2] === null) kept[kept.length - 1] = point;
  }
  return kept;
}
