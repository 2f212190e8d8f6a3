// What the browser keeps for the page, and what was typed into a form; one that keeps nothing is as good as an empty one.

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

/** Fill the form as it was left under this name, and keep what is changed from now on. Returns the
 *  fields that were left otherwise than they are at first.
 *  @param {HTMLElement} form @param {string} name */
export function remembered(form, name) {
  const fields = [...form.querySelectorAll("input, select")].filter(
    (one) => one instanceof HTMLInputElement || one instanceof HTMLSelectElement,
  );
  const kept = stored(sessionStorage, name);
  const usable = Array.isArray(kept) && kept.length === fields.length;
  const changed = usable ? fields.filter((field, at) => fill(field, kept[at])) : [];
  form.addEventListener("input", () => store(sessionStorage, name, fields.map(saying)));
  return changed;
}

/** @param {HTMLInputElement | HTMLSelectElement} field */
function saying(field) {
  return isTick(field) ? field.checked : field.value;
}

/** Whether that made it another. @param {HTMLInputElement | HTMLSelectElement} field @param {unknown} value */
function fill(field, value) {
  if (saying(field) === value) return false;
  if (isTick(field)) field.checked = Boolean(value);
  else field.value = String(value);
  field.dispatchEvent(new Event("change", { bubbles: true }));
  return true;
}

/** @param {HTMLInputElement | HTMLSelectElement} field @returns {field is HTMLInputElement} */
function isTick(field) {
  return field.type === "checkbox";
}
