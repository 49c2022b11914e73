// Colours of what is drawn, the same in the scene and in the legend.

export const COLOURS = {
  axes: ["#ff6b6b", "#51cf66", "#4dabf7"],
  field: "#c77dff",
  sun: "#ffd43b",
  rate: "#ff922b",
  dipole: "#22d3ee",
  horizon: "#74c0fc",
  earth: "#2f5d8c",
  grid: "#7aa5d0",
  track: "#dee2e6",
  umbra: "#adb5bd",
  lit: "#8f9bb3",
  panel: "#2b4a8b",
  grey: "#6c6c6c",
};
