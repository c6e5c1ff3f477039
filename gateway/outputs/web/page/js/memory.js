// SPDX-License-Identifier: Apache-2.0
// Stores the user's choices in the browser. Without storage the browser forgets them when the page is closed.

// The path is a part of the key, because a proxy may show several gateways, each below its own path.
const keyOf = (name) => `${name} ${location.pathname}`;

export function recall(name, otherwise) {
  try {
    return JSON.parse(localStorage.getItem(keyOf(name))) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function remember(name, value) {
  try {
    localStorage.setItem(keyOf(name), JSON.stringify(value));
  } catch {
    // Without storage, the choice lasts as long as the page.
  }
}
