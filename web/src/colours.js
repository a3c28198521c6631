// Colours of agents and of maps, for dark and for light paper. Those of agents have a contrast of 3 : 1 and more with
// it, as graphics need.
const kAgents = {
  dark: ['#4cc2ff', '#ffb454', '#7ee787', '#e9a3ff', '#ff8f87', '#5fe3d3', '#ffe066', '#b9a6ff'],
  light: ['#0069b4', '#a85400', '#18753a', '#8f2fa8', '#c0272d', '#006d6d', '#6f5600', '#5b3cc4'],
};
const kMaps = {
  dark: ['#6cb8f0', '#f0b070', '#90d890', '#d8a0e8', '#f09a94', '#80d8d0'],
  light: ['#2b7fc0', '#c07828', '#3a9a58', '#a05cb8', '#cc5c58', '#2f9a94'],
};

export const agentColour = (theme, index) => kAgents[theme][index % kAgents.dark.length];
export const mapColour = (theme, id) => kMaps[theme][id % kMaps.dark.length];
export const kPaper = { dark: '#0e1216', light: '#e6eaee' };
export const kGrid = { dark: '#4a5663', light: '#9aa7b3' };
export const kMark = { dark: '#ffe066', light: '#b3261e' };

// Of a dense point's confidence, from 0 to 1 in equal steps: red, orange, green, each lighter than the one before, so
// that they are told apart without colours.
export const kConfidence = ['#b3261e', '#f0a030', '#7ee787'];

// [r, g, b] of a confidence: linear between the stops.
export function confidenceColour(confidence) {
  const at = Math.max(0, Math.min(1, confidence)) * (kConfidence.length - 1);
  const first = Math.min(Math.floor(at), kConfidence.length - 2);
  const [low, high] = [rgb(kConfidence[first]), rgb(kConfidence[first + 1])];
  return low.map((v, k) => v + (at - first) * (high[k] - v));
}

export function rgb(hex) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
}
