import assert from 'node:assert/strict';
import test from 'node:test';
import { confidenceColour, kConfidence, rgb } from '../src/colours.js';

// Relative luminance of WCAG.
const luminance = (colour) => {
  const [r, g, b] = colour.map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};

test('Confidence goes from red to green, and each stop is met', () => {
  kConfidence.forEach((hex, i) => assert.deepEqual(confidenceColour(i / (kConfidence.length - 1)), rgb(hex)));
  const [red, green] = [confidenceColour(0), confidenceColour(1)];
  assert.ok(red[0] > 3 * red[1] && green[1] > green[0] && green[1] > green[2]);
  assert.deepEqual([confidenceColour(-1), confidenceColour(2)], [red, green]);
});

test('The surer, the lighter: colours are told apart without their hue', () => {
  let before = 0;
  for (let i = 0; i <= 50; ++i) {
    const now = luminance(confidenceColour(i / 50));
    assert.ok(now > before, `${i / 50}: ${now}`);
    before = now;
  }
});
