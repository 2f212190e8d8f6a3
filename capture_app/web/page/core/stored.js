// What the browser keeps for the page; one that keeps nothing is as good as an empty one.

/** The value kept under a name; null for none. @param {Storage} storage @param {string} name */
export function stored(storage, name) {
  try {
    return JSON.parse(storage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

/** Keep a value; null takes it away. @param {Storage} storage @param {string} name @param {unknown} value */
export function store(storage, name, value) {
  try {
    if (value === null) storage.removeItem(name);
    else storage.setItem(name, JSON.stringify(value));
  } catch {
    // Private windows and full disks refuse; the page goes on without.
  }
}
