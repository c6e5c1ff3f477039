// SPDX-License-Identifier: Apache-2.0
// Passes events between the parts of the page: login, link, values, points, alarms, session.

const listeners = new Map();

/** Calls `listener` for each event of this name. Returns the function that removes the listener. */
export function on(event, listener) {
  if (!listeners.has(event)) listeners.set(event, new Set());
  listeners.get(event).add(listener);
  return () => listeners.get(event).delete(listener);
}

export function emit(event, value) {
  for (const listener of [...(listeners.get(event) || [])]) listener(value);
}
