// Medians: one definition for the page. Pure functions.

// sorted: an array or a typed array in ascending order. The mean of the two middle values for an even number; NaN for none.
export function medianOfSorted(sorted) {
  const half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

// Of values in any order; 0 for none.
export function median(values) {
  return values.length === 0 ? 0 : medianOfSorted([...values].sort((a, b) => a - b));
}
