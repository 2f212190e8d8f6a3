// Numbers that arithmetic brings near each other.
import assert from "node:assert/strict";

/** Whether each number is where it should be, within what single precision leaves. */
export function near(found, wanted, within = 1e-6) {
  const [all, others] = [Array.from(found), Array.from(wanted)];
  assert.equal(all.length, others.length);
  const off = all.map((value, k) => Math.abs(value - others[k]));
  const worst = Math.max(0, ...off);
  assert.ok(worst <= within, `${all} is off ${others} by ${worst}`);
}
