// How time goes on while a scene plays.

/** Where `seconds` more of playing lead, and whether it stops there.
 *  @param {number} time @param {number} seconds @param {number} duration @param {boolean} loop */
export function playedOn(time, seconds, duration, loop) {
  const next = time + seconds;
  if (next <= duration) return { time: next, stops: false };
  if (loop) return { time: next % duration, stops: false };
  return { time: duration, stops: true };
}
