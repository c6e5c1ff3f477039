// SPDX-License-Identifier: Apache-2.0
// What the parts of the page tell each other: login, link, values, points, alarms, session.

const listeners = new Map();

/** Returns the function that ends it. */
export function on(event, listener) {
  if (!listeners.has(event)) listeners.set(event, new Set());
  listeners.get(event).add(listener);
  return () => listeners.get(event).delete(listener);
}

export function emit(event, value) {
  for (const listener of [...(listeners.get(event) || [])]) listener(value);
}
